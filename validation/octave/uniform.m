% Listing 4.3, unchanged.
function [coords,b] = uniform(n)
  sn = sqrt(n);
  [x,y] = meshgrid(linspace(0,1,sn));
  coords = [x(:) y(:)];
  b = [2:sn-1 1:sn:n-sn sn:sn:n-sn n-sn+1:n;...
      zeros(1,sn*4-4)];
endfunction
