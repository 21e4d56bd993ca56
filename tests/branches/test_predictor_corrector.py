"""The continuation driver on curves in closed form."""

import math

import numpy as np
import pytest

from asperity.algebra.predictor_corrector import STEPS, STUCK, Attempt, Curves, StepControl, follow

CONTROL = StepControl(
    shortest=1e-4,
    longest=0.3,
    growth=1.5,
    easy=4,
    hard=6,
    sharpest_turn=0.7,
    farthest=np.inf,
    most_failures=8,
)


class Plane(Curves):
    """The curve f(x, y) = 0 from a point on it, until `ended` says why it ends."""

    def __init__(self, f, gradient, start, tangent, ended, control=CONTROL):
        self.f, self.gradient, self.ended, self.control = f, gradient, ended, control
        self.path, self.tangent = [np.array(start)], np.array(tangent)

    def attempts(self, rows, length, failures):
        x = guess = self.path[-1] + length[0] * self.tangent
        for _ in range(6):
            matrix = np.array([self.gradient(*x), self.tangent])
            x = x - np.linalg.solve(matrix, [self.f(*x), self.tangent @ (x - guess)])
        along = np.array([-self.gradient(*x)[1], self.gradient(*x)[0]])
        along = along * np.sign(along @ self.tangent) / np.linalg.norm(along)
        there = (x, along) if abs(self.f(*x)) < 1e-10 else None
        miss = float(np.linalg.norm(x - guess) / length[0])
        turn = float(along @ self.tangent)
        yield rows, Attempt.of_one(there, length[0], iterations=3, turn=turn, miss=miss)

    def accept(self, rows, chosen, attempt):
        x, self.tangent = attempt.next
        self.path.append(x)
        return [self.ended(self)]


def circle(x, y):
    return x**2 + y**2 - 1


def once_around(curve):
    x, y = curve.path[-1]
    return "around" if y > 0 and x > 0 and len(curve.path) > 5 and curve.path[-2][1] <= 0 else ""


def test_a_circle_is_followed_through_its_folds():
    curve = Plane(circle, lambda x, y: (2 * x, 2 * y), (1, 0), (0, 1), once_around)
    assert follow(curve, np.array([0.01])) == ["around"]
    path = np.array(curve.path)
    np.testing.assert_allclose(np.hypot(*path.T), 1, atol=1e-9)
    assert (np.diff(np.unwrap(np.arctan2(path[:, 1], path[:, 0]))) > 0).all()
    # Steps grow from the first to the longest.
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() == pytest.approx(0.3, rel=0.1)


@pytest.mark.parametrize("limit", [{"sharpest_turn": 0.95}, {"farthest": 0.2}])
def test_a_step_that_turns_or_misses_too_much_is_taken_shorter(limit):
    """Around a circle a step of length s turns by about s and misses by about s/2."""
    control = CONTROL._replace(longest=1.0, **limit)
    curve = Plane(circle, lambda x, y: (2 * x, 2 * y), (1, 0), (0, 1), once_around, control)
    assert follow(curve, np.array([0.9])) == ["around"]
    turns = np.diff(np.unwrap([math.atan2(y, x) for x, y in curve.path]))
    assert turns.max() < 0.42


def test_a_curve_ends_with_its_reason_and_steps_are_limited():
    def half_line(x, y):  # approached by ever shorter steps
        return y - (0.0 if x < 1 else math.nan)

    def straight(x, y):
        return (0, 1)

    curve = Plane(half_line, straight, (0, 0), (1, 0), lambda _: "")
    assert follow(curve, np.array([0.3])) == [STUCK]
    assert 1 - curve.path[-1][0] < 1e-3
    curve = Plane(half_line, straight, (0, 0), (1, 0), lambda _: "")
    assert follow(curve, np.array([0.01]), most=3) == [STEPS]
    assert len(curve.path) == 4


class Lines(Curves):
    """Several straight ways to 1, of which each needs steps of its own; some fail at first."""

    control = CONTROL

    def __init__(self, failing):
        self.at, self.failing = np.zeros(len(failing)), np.array(failing)

    def aimed(self, length, failures):
        return np.minimum(length, 1 - self.at)

    def attempts(self, rows, length, failures):
        good = failures[rows] >= self.failing[rows]
        one = np.ones(len(rows))
        yield rows, Attempt(length[rows], good, 3 * one, one, 0 * one, length[rows])

    def accept(self, rows, chosen, attempt):
        self.at[rows] += attempt.next[chosen]
        self.failing[rows] = 0
        return ["arrived" if self.at[row] >= 1 else "" for row in rows]


def test_curves_followed_together_have_separate_step_lengths():
    lines = Lines([0, 3, 9])
    assert follow(lines, np.full(3, 0.1)) == ["arrived", "arrived", STUCK]
    np.testing.assert_allclose(lines.at, [1, 1, 0])
