% Listing 4.2, unchanged.
function A = first_derivative(tri,points)
  dim = size(points,2);
  n = size(points,1)*dim;
  A = spalloc(n,n,dim*dim*3*size(tri,1));
  for i=1:size(tri,1)
    d=points(tri(i,:),:)-points(shift(tri(i,:),-1),:);
    d./=sqrt(sum(d.^2,2));
    for j=1:3
      dj = d(j,:)'*d(j,:);
      ds = (1:dim)+(tri(i,j)-1)*dim;
      dt = (1:dim)+(tri(i,mod(j,3)+1)-1)*dim;
      A(ds,dt)-=A(dt,ds)-(A(dt,ds)-=dj);
      A(ds,ds) += dj;
      A(dt,dt) += dj;
    endfor
  endfor
endfunction
