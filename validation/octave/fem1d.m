% Listing 4.1. Changed: the nodes are passed in (line 5 generated them at random), and the solution is returned (lines 26 and 27 plotted it).
function sol = fem1d(domain, peclet=1)
    count = numel(domain);
    [dirichlet,neumann] = (@() size([1,2]))();
    sources = 1.*ones(1,count-1);
    right_side = (diff_op = zeros(count))(:,1);
    for e=2:count
        idel = peclet./(domain(e)-domain(e-1));
        pos=[e-1,e];
        diff_op(pos,pos)+=[-idel idel; idel -idel];
        right_side(pos)+=sources(e-1)*.5.*[1;1]./idel;
    endfor
    conds = [dirichlet,1,0;neumann,count,-1];
    for i=1:size(conds,1)
        pos = conds(i,2);
        if conds(i,1)==neumann
            right_side(pos)-=conds(i,3);
        elseif conds(i,1)==dirichlet
            right_side-=conds(i,3)*diff_op(:,conds(i,2));
            diff_op(:,pos)=diff_op(pos,:)=0;
            diff_op(pos,pos)=1;
            right_side(pos)=conds(i,3);
        endif
    endfor
    sol=diff_op\right_side;
endfunction
