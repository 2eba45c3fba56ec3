% Listing 4.4. Changed: its lines 4 and 5 are one line.
function [A,b] = dirichlet(A,b,dimension,bnds)
  for i=1:size(bnds,2)
    val = bnds(2,i);
    for j=(dimension*bnds(1,i)-dimension+1):dimension*bnds(1,i)
      b-=val*A(:,j);
      A(:,j)=A(j,:)=0;
      A(j,j)=1;
      b(j)=val;
    endfor
  endfor
endfunction
