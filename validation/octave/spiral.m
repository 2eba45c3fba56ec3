% Equation 4.11, which has no listing. The report does not state its boundary: here the vertices of the convex hull, at 0.
function [tri,points,bnds] = spiral(n)
  i = (1:n)';
  theta = i*(1+sqrt(5))/2;
  points = (i/n).*[cos(theta) sin(theta)];
  tri = delaunay(points);
  rim = convhull(points)(1:end-1)';
  bnds = [rim; zeros(1,numel(rim))];
endfunction
