"""Blocks that are squeezed in the catalogue say how their corners fold over."""

from fem_reference.verification.squeeze import ENTRIES


def test_a_squeezed_block_reports_its_smallest_determinant(fem_lab) -> None:
    note = next(entry for entry in ENTRIES if entry.name == "bonded_squeeze_is_inverted").find(fem_lab).note
    # The corner folds over at its vertex while det F is far from zero at all quadrature points.
    assert "inverted: Newton's method converged, but det F fell to -0.0" in note
    assert "at a vertex" in note
