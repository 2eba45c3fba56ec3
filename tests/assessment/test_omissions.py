"""Verdicts on omissions by the error bar, and the phases of their time."""

from fem_reference.assessment.omissions import PHASES, Omission, verdict


def test_a_number_that_is_not_known_is_no_verdict() -> None:
    bars = {"volume.deviation": 0.1}
    assert verdict({}, bars) == "not known"
    assert verdict({"volume.deviation": 0.0, "surface_deviation.rms": 1.0}, bars) == "not known"
    assert verdict({"volume.deviation": 0.2, "surface_deviation.rms": 1.0}, bars) == "matters"
    assert verdict({"volume.deviation": 0.0}, {"volume.deviation": 0.0}) == "does not matter"
    assert verdict({"volume.deviation": 1e-9}, {"volume.deviation": 0.0}) == "matters"


def test_an_omission_matters_beyond_its_bar_and_hardly_within() -> None:
    assert [verdict({"volume.deviation": x}, {"volume.deviation": 0.1}) for x in (0.009, 0.011, 0.099, 0.101)] == [
        "does not matter",
        "hardly",
        "hardly",
        "matters",
    ]


def test_a_phase_is_its_share_of_the_processor_time_of_solving() -> None:
    seconds = {"assembly": 1.0, "contact": 2.0, "factorisation": 3.0, "krylov": 4.0, "solve": 20.0}
    costs = {f"seconds_{name}": value for name, value in seconds.items()} | {"seconds_processor_solve": 40.0}
    one = Omission((), "converged", "", costs=costs)
    assert {name: one.phase(name) for name in PHASES} == {"assembly": 2.0, "contact": 4.0, "linear systems": 14.0}
