% Writes the inputs of witness.m below the folder `to`, in the files that listing 4.5 loads: tri.csv, points.csv, bounds.csv.
function make_inputs(to)
  rand("twister",42);
  mkdir(fullfile(to,"rod"));
  csvwrite(fullfile(to,"rod","nodes.csv"),[0 sort(rand(1,98)) 1]',"precision","%.17g");
  csvwrite(fullfile(to,"rod","peclet.csv"),[1 10 1000],"precision","%.17g");
  [tri,points,bnds] = square();
  write(fullfile(to,"plate_square"),tri,points,bnds);
  [tri,points,bnds] = spiral(400);
  write(fullfile(to,"plate_spiral"),tri,points,bnds);
  [tri,points,bnds] = pear(200);
  write(fullfile(to,"surface"),tri,points,bnds);
endfunction

function write(folder,tri,points,bnds)
  mkdir(folder);
  csvwrite(fullfile(folder,"tri.csv"),tri);
  csvwrite(fullfile(folder,"points.csv"),points,"precision","%.17g");
  csvwrite(fullfile(folder,"bounds.csv"),bnds,"precision","%.17g");
endfunction
