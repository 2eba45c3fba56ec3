% Listing 4.5, lines 7, 8 and 10 to 12: the plate that it generates if it loads none.
function [tri,points,bnds] = square()
  bound = [-1 -1; 1 1];
  count = 20;
  [points,bnds] = uniform(count.^2);
  points = points.*(bound(2,:)-bound(1,:))+bound(1,:);
  tri = delaunay(points);
endfunction
