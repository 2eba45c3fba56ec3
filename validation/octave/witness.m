% Runs the listings on the inputs below the folder `from` and writes their results below the folder `to`, with 17 digits.
%   rod/solution.csv: a column for each Peclet number.
%   <plate or surface>/solution.csv: for each vertex the plotted norm, the vector unknown, and the operator times cos(1), cos(2), ...
function witness(from,to)
  nodes = csvread(fullfile(from,"rod","nodes.csv"));
  peclet = csvread(fullfile(from,"rod","peclet.csv"));
  rod = cell2mat(arrayfun(@(p) fem1d(nodes',p),peclet,"UniformOutput",false));
  write(fullfile(to,"rod"),rod);
  for name={"plate_square","plate_spiral","surface"}
    folder = fullfile(from,name{1});
    tri = csvread(fullfile(folder,"tri.csv"));
    points = csvread(fullfile(folder,"points.csv"));
    bnds = csvread(fullfile(folder,"bounds.csv"));
    [x,unknown] = fem2d(tri,points,bnds);
    product = reshape(first_derivative(tri,points)*cos(1:numel(points))',size(points,2),[])';
    write(fullfile(to,name{1}),[x unknown product]);
  endfor
endfunction

function write(folder,values)
  if !isfolder(folder)
    mkdir(folder);
  endif
  csvwrite(fullfile(folder,"solution.csv"),values,"precision","%.17g");
endfunction
