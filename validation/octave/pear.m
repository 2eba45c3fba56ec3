% A closed surface of n vertices for listing 4.5 in three dimensions: the hull of points on a sphere, oriented outwards, then stretched,
% narrowed and bent. Two neighbouring points at its front are fixed, one at 0 and one at 5 (to test a value other than 0).
function [tri,points,bnds] = pear(n)
  i = (1:n)';
  z = 1-(2*i-1)/n;
  theta = i*pi*(3-sqrt(5));
  ball = [sqrt(1-z.^2).*cos(theta) sqrt(1-z.^2).*sin(theta) z];
  tri = convhulln(ball);
  for t=1:size(tri,1)
    if det(ball(tri(t,:),:))<0
      tri(t,:) = tri(t,[1 3 2]);
    endif
  endfor
  y = ball(:,2);
  points = [ball(:,1).*(1-0.35*y) 1.8*y 0.7*ball(:,3).*(1-0.35*y)+0.2*y.^2];
  [~,nearest] = sort(sum((ball-[0 0.6 0.8]).^2,2));
  bnds = [nearest(1:2)'; 0 5];
endfunction
