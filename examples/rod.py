"""The report's rod (listing 4.1): the result of the listing, and finite element solutions of the same equation."""

import numpy as np

import fem_reference as fr

case = fr.load_case("rod")
reference, listing = fr.solve(case), fr.solve(case, "listing")
x = reference.points[:, 0]
print("psi(1) by the text, eq. 4.10:", 1 / 2 - 2, "by the listing:", listing.vertex_values[0, np.argmax(x)])

# With fewer, evenly spaced nodes: linear elements are exact at the nodes; between them the error is up to h^2 / 8.
for count in (5, 9, 17):
    coarse = fr.load_case("rod", {"domain.interval": {"start": 0.0, "end": 1.0, "count": count}})
    result = fr.compare(coarse, fr.solve(coarse))
    print(count, "nodes: L2 error", result["reference", "l2_error", "norm"].values[0])
print("greatest difference at nodes:", np.abs(listing.vertex_values - reference.vertex_values).max())
# Ends in 0 within 1e-10: both are exact at the nodes.
