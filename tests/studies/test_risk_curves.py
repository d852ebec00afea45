"""What is drawn of several studies, and against what."""

from __future__ import annotations

from clearway.studies.figures.risk_curves import draw_risk_curves


def study(vehicle="copter", surveillance="ads-b", range_m=2000.0, encounters=100, ratio=0.1):
    one = {"ratio": ratio, "ratio_95": [0.5 * ratio, 2.0 * ratio]}
    measures = {"near_collision": one, "lost_well_clear": one, "mean_aside_m": 40.0}
    return {
        "vehicle": vehicle, "surveillance": surveillance, "range_m": range_m,
        "encounters": encounters, "planners": {"clearway": measures, "mvp": measures},
    }  # fmt: skip


def marks(axes) -> list[tuple[float, float]]:
    return [
        (float(x), float(y))
        for container in axes.containers
        for x, y in zip(*container.lines[0].get_data(), strict=True)
    ]


def test_ranges_stand_beside_what_avoiding_costs():
    figure = draw_risk_curves([study(range_m=1e3 * far) for far in (2.0, 4.0, 8.0)])
    assert len(figure.axes) == 4
    assert sorted({round(x) for x, _ in marks(figure.axes[0])}) == [2, 4, 8]
    assert "ads-b" in figure.axes[0].get_xlabel()


def test_kinds_of_surveillance_at_one_range_have_an_axis_of_their_own():
    kinds = ("radar", "ads-b", "perfect")
    studies = [study(surveillance=kind) for kind in kinds] + [study(range_m=8000.0)]
    figure = draw_risk_curves(studies)
    assert len(figure.axes) == 6
    against = figure.axes[1]
    names = [label.get_text() for label in against.get_xticklabels()]
    assert sorted(names) == sorted(kinds)
    assert len(marks(against)) == 2 * len(kinds)
    assert "2 km" in against.get_xlabel()
    assert len(marks(figure.axes[0])) == 4, "those of ads-b alone"


def test_of_two_studies_of_one_kind_the_larger_one_is_drawn():
    figure = draw_risk_curves([study(ratio=0.1), study(ratio=0.3, encounters=5000)])
    assert {y for _, y in marks(figure.axes[0])} == {0.3}


def test_kinds_are_compared_by_studies_of_as_many_encounters():
    kinds = ("radar", "ads-b", "perfect")
    studies = [study(surveillance=kind, encounters=300) for kind in kinds]
    figure = draw_risk_curves([*studies, study(ratio=0.3, encounters=5000)])
    assert {y for _, y in marks(figure.axes[1])} == {0.1}
    assert {y for _, y in marks(figure.axes[0])} == {0.3}
