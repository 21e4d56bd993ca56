"""Tracing on planes whose boundary is a formula."""

import numpy as np
import pytest

from asperity.study.map.boundary import trace_boundary


def traced(plane):
    boundary = trace_boundary(plane, plane.solve(plane.nodes()))
    lines = [boundary.where[boundary.line == k] for k in range(boundary.line.max(initial=-1) + 1)]
    return boundary, lines


def circle(x, y):
    return np.hypot(x - 0.5, y - 0.5) - 0.3


@pytest.mark.parametrize("count", [8, 31])
def test_a_closed_boundary_is_met_everywhere_to_1e_4(known, count) -> None:
    boundary, (line,) = traced(known(circle, count))
    assert boundary.unresolved == 0
    assert (boundary.line == 0).all()
    assert line[0].tolist() == line[-1].tolist()
    # Its points, and every point of the chords between them.
    t = np.linspace(0.0, 1.0, 9)[:, None, None]
    chords = (1 - t) * line[:-1] + t * line[1:]
    assert np.abs(circle(*np.moveaxis(line, -1, 0))).max() < 2e-6
    assert np.abs(circle(*np.moveaxis(chords, -1, 0))).max() < 1e-4
    # Shoelace formula: the order along the line is right.
    area = 0.5 * abs(np.sum(line[:-1, 0] * line[1:, 1] - line[1:, 0] * line[:-1, 1]))
    assert area == pytest.approx(np.pi * 0.3**2, rel=1e-3)


def test_an_open_boundary_runs_from_side_to_side(known) -> None:
    _, (line,) = traced(known(lambda x, y: y - 0.2 - 0.5 * x**2, 12))
    assert sorted(line[[0, -1], 0].tolist()) == [0.0, 1.0]
    step = np.diff(line[:, 0])
    assert (step > 0).all() or (step < 0).all()


def test_a_kink_where_another_mode_takes_the_lead(known) -> None:
    def g(x, y):
        return np.maximum(x - 0.613, y - 0.417)

    _, (line,) = traced(known(g, 10))
    x, y = line.T
    on_either = np.minimum(np.abs(x - 0.613), np.abs(y - 0.417))
    assert on_either.max() < 2e-6
    assert (x < 0.6130021).all()
    assert (y < 0.4170021).all()


def test_a_saddle_is_decided_by_its_middle(known) -> None:
    # Near the centre of the only cell: the corners (0, 0) and (1, 1) are connected, or not.
    def ridge(sign):
        return lambda x, y: sign * ((x - 0.5) * (y - 0.5) + 0.02)

    for sign in (1, -1):
        _, lines = traced(known(ridge(sign), 2))
        assert len(lines) == 2
        sides = [
            {tuple(np.sign(end - 0.5).astype(int)) for end in np.round(line[[0, -1]], 9)}
            for line in lines
        ]
        # (x - 1/2)(y - 1/2) = -0.02 has its branches in the quadrants x < 1/2 < y and y < 1/2 < x.
        assert sorted(sorted(s) for s in sides) == [[(-1, 1)], [(1, -1)]]


def test_a_boundary_too_sharp_for_the_grid_is_told(known) -> None:
    # A spike of half width 0.008 to 0.016 and of the height 0.2, in cells of 0.1.
    boundary, _ = traced(
        known(lambda x, y: y - 0.33 - 0.4 * np.exp(-(((x - 0.5) / 0.01) ** 2)), 11)
    )
    assert boundary.unresolved > 0


def test_points_without_response_end_the_boundary(known) -> None:
    plane = known(circle, 21, failed=lambda x, y: x > 0.6)
    boundary, lines = traced(plane)
    found = boundary.where[boundary.line >= 0]
    assert found[:, 0].max() <= 0.6 + 1e-9
    assert len(lines) == 1
    assert lines[0][0].tolist() != lines[0][-1].tolist()


def test_a_failure_within_an_edge_keeps_its_reason(known) -> None:
    # Nodes at multiples of 0.1 are solved, what lies around y = 0.55 between them is not.
    plane = known(lambda x, y: y - 0.55, 11, failed=lambda x, y: np.abs(y - 0.55) < 0.04)
    boundary, lines = traced(plane)
    assert lines == []
    assert (boundary.line == -1).all()
    assert len(boundary.line) == 11
    assert all("are invalid" in reason for reason in boundary.reason)


def test_a_jump_is_no_crossing(known) -> None:
    plane = known(lambda x, y: np.where(x > 0.437, 1.0, -0.5), 9)
    boundary, lines = traced(plane)
    assert lines == []
    assert all("jumps" in reason for reason in boundary.reason)
    np.testing.assert_allclose(boundary.where[:, 0], 0.437, atol=2e-6)


def test_nothing_to_trace(known) -> None:
    boundary, lines = traced(known(lambda x, y: x + 1.0, 5))
    assert lines == []
    assert boundary.where.shape == (0, 2)
