% Listing 4.5. Changed: the mesh is passed in (lines 2 to 13), line 17 (see README.md), and the vector unknown is returned too
% (line 20 computes its norm x; lines 22 to 27 plotted -x).
function [x,unknown] = fem2d(tri,points,bnds)
  dim = size(points,2);
  A = first_derivative(tri,points);
  b = zeros(size(A,1),1);
  b+=repmat(points(:,2)'>mean(points,1)(2),dim,1)(:);
  A=(0.05*eye(size(A))+2*A+26*A*A);
  [A,b]=dirichlet(A,b,dim,bnds);
  unknown=reshape((A\b),size(points,2),size(points,1))';
  x=sqrt(sum(unknown.^2,2));
endfunction
