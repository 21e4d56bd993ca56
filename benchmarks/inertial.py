"""Responses with inertia, compared with heyoka and SciPy: ``python -m benchmarks.inertial``.

With elastic asperities the equations are not stiff, and heyoka shoots with variational equations.
With rigid asperities they are stiff, and SciPy's Radau shoots. Both start within 1e-5 of the
answer, asperity without an initial guess. In a second row heyoka starts at the averaged limit, as
asperity does. Times are on one core; errors are the largest relative differences of mean and first
harmonics.
"""

from __future__ import annotations

import argparse

import numpy as np

import asperity as asp
from asperity.orbit.methods.shooting import averaged_start
from asperity.slider.problem import checked_problem, flatten
from benchmarks import ours
from benchmarks.cases import FREQUENCY, Batch, batch
from benchmarks.clock import pin_to_one_core, timed

_OMEGA = 2 * np.pi * FREQUENCY
_SAMPLES = 128
_TOLERANCE = 1e-10
#: Newton's method: step at convergence, most steps, and largest change of an exponent in a step.
_CLOSED, _NEWTON_STEPS, _LARGEST_CHANGE = 1e-8, 20, 3.0


def respond(points: Batch) -> asp.orbit.PeriodicResponse:
    """Periodic response with inertia."""
    return ours.respond(points, inertia=True, harmonics=2, workers=1)


def numbers_of(points: Batch) -> dict[str, np.ndarray]:
    """Dimensionless numbers of the equations, each (points,)."""
    slider = points.slider()
    gains = {
        "mobility": slider.W0 / (slider.M * points.velocity * _OMEGA),
        "strain": points.velocity / (np.maximum(slider.law.elastic_length, 1e-300) * _OMEGA),
    }
    return points.numbers() | gains


class HeyokaShooting:
    """States: (F/W0 - start)/kappa, v/V, F_i/W, ln(V Phi/D0)."""

    def __init__(self) -> None:
        import heyoka as hy

        names = ("mu", "A", "B", "kappa", "ageing", "epsilon", "mobility", "strain")
        self.names = names
        self.lanes = 2 * hy.recommended_simd_size()
        force, v, friction, phi = hy.make_vars("force", "v", "friction", "phi")
        p = {name: hy.par[i] for i, name in enumerate(names)}
        offset = hy.par[len(names)]
        slip = hy.exp((friction - p["mu"] - p["B"] * phi) / p["A"])
        w = 1.0 + p["epsilon"] * hy.cos(hy.time)
        spring = offset + p["kappa"] * force
        equations = [
            (force, 1.0 - v),
            (v, p["mobility"] * (spring - w * friction)),
            (friction, p["strain"] * (v - slip)),
            (phi, p["ageing"] * (hy.exp(-phi) - v)),
        ]
        self.integrator = hy.taylor_adaptive_batch(
            hy.var_ode_sys(equations, hy.var_args.vars, order=1),
            np.zeros((20, self.lanes)),
            tol=_TOLERANCE,
            pars=np.zeros((len(names) + 1, self.lanes)),
            compact_mode=False,
        )
        self.grid = np.repeat(np.linspace(0, 2 * np.pi, _SAMPLES + 1)[:, None], self.lanes, axis=1)

    def solve(self, points: Batch, start: np.ndarray) -> np.ndarray:
        """Mean, mu1 and mu2 of each point, (3, points), from `start`, (4, points)."""
        numbers, answers = numbers_of(points), []
        filled = np.resize(np.arange(len(points)), -(-len(points) // self.lanes) * self.lanes)
        for part in filled.reshape(-1, self.lanes):
            table = np.array([numbers[name][part] for name in self.names])
            answers.append(self._shoot(table, start[:, part]))
        return np.concatenate(answers, axis=1)[:, : len(points)]

    def _shoot(self, table: np.ndarray, start: np.ndarray) -> np.ndarray:
        offset, kappa = start[0], table[self.names.index("kappa")]
        y = np.concatenate([np.zeros_like(start[:1]), start[1:]])
        self.integrator.pars[:] = np.concatenate([table, offset[None]])
        for _ in range(_NEWTON_STEPS):
            self.integrator.set_time(0.0)
            self.integrator.state[:4] = y
            self.integrator.state[4:] = np.eye(4).reshape(16, 1)
            path = self.integrator.propagate_grid(self.grid)[-1]
            monodromy = np.moveaxis(path[-1, 4:].reshape(4, 4, -1), -1, 0)
            step = np.linalg.solve(monodromy - np.eye(4), (y - path[-1, :4]).T[..., None])[..., 0].T
            # The velocity must converge too, as the second harmonic depends on it.
            if np.abs(step[1:]).max() < _CLOSED:
                break
            A, B = (table[self.names.index(name)] for name in "AB")
            exponent = np.maximum(np.abs(step[2]) / A, np.abs(step[3]) * B / A)
            y = y + step / np.maximum(1.0, exponent / _LARGEST_CHANGE)
        spectrum = np.fft.rfft(offset + kappa * path[:-1, 0], axis=0) / _SAMPLES
        return np.abs([spectrum[0], 2 * spectrum[1], 2 * spectrum[2]])


def scipy_radau(points: Batch, start: np.ndarray) -> np.ndarray:
    """Shooting with SciPy's Radau and differences; states (F/W0, ln(v/V), ln(V Phi/D0))."""
    from scipy.integrate import solve_ivp

    answers = []
    for i in range(len(points)):
        n = {name: float(value[i]) for name, value in numbers_of(points).items()}

        def rates(t: float, y: np.ndarray, n: dict = n) -> list[float]:
            force, u, phi = y
            w, v = 1 + n["epsilon"] * np.cos(t), np.exp(u)
            excess = force - w * (n["mu"] + n["A"] * u + n["B"] * phi)
            pull = n["mobility"] * excess / v
            return [n["kappa"] * (1 - v), pull, n["ageing"] * (np.exp(-phi) - v)]

        def flow(y: np.ndarray, rates=rates, **options):
            return solve_ivp(rates, (0, 2 * np.pi), y, "Radau", rtol=1e-8, atol=1e-11, **options)

        y = start[:, i]
        for _ in range(8):
            end = flow(y).y[:, -1]
            scale = np.array([1e-4, 1e-2, 1e-2])
            columns = [
                (flow(y + s * e).y[:, -1] - end) / s for s, e in zip(scale, np.eye(3), strict=True)
            ]
            step = np.linalg.solve(np.stack(columns, axis=1) - np.eye(3), y - end)
            y = y + step
            if np.abs(step).max() < 1e-8:
                break
        path = flow(y, dense_output=True).sol(np.linspace(0, 2 * np.pi, _SAMPLES, endpoint=False))
        spectrum = np.fft.rfft(path[0]) / _SAMPLES
        answers.append(np.abs([spectrum[0], 2 * spectrum[1], 2 * spectrum[2]]))
    return np.stack(answers, axis=1)


def _near(answers: asp.orbit.PeriodicResponse, points: Batch) -> np.ndarray:
    """States within 1e-5 of the answers, (size, points), with ln(V Phi/D0) for ln(V0 Phi/D0)."""
    start = answers.start[: len(points)].T.copy()
    start[1:] *= 1 + 1e-5
    start[-1] += np.log(points.velocity / points.slider().law.V0)
    return start


def _averaged(points: Batch) -> np.ndarray:
    """The initial guess of asperity, in the same form."""
    drive = {"velocity": points.velocity, "epsilon": points.epsilon, "frequency": FREQUENCY}
    problem = checked_problem(points.slider(), inertia=True, **drive)
    start = np.array(averaged_start(flatten(problem)[0])[0])
    start[-1] += np.log(points.velocity / points.slider().law.V0)
    return start


def _compare(law: str, count: int, peer_count: int, peers: dict[str, tuple]) -> None:
    points = batch(law, count)
    seconds, response = timed(lambda: respond(points), 3 if count > 200 else 1)
    assert response.converged.all()
    few = points.part(slice(peer_count))
    expected = np.stack([response.mean_friction, response.mu1, response.mu2])[:, :peer_count]
    each = seconds / count * 1e6
    for peer, (solve, start_of, warm_up) in peers.items():
        start = start_of(response, few)
        peer_seconds, answer = timed(lambda: solve(few, start), 1, warm_up=warm_up)  # noqa: B023
        error, theirs = np.abs(answer / expected - 1).max(), peer_seconds / peer_count * 1e6
        print(
            f"| {law} | {each:,.0f} | {peer} | {theirs:,.0f} | {theirs / each:.3g} | {error:.0e} |"
        )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.inertial", description=__doc__)
    parser.add_argument("--points", type=int, default=12_000)
    arguments = parser.parse_args()
    pin_to_one_core()
    print("| law | asperity us/point | peer | us/point | ratio | difference |")
    print("|---|---|---|---|---|---|")
    averaged = "heyoka from the averaged limit"
    try:
        heyoka = HeyokaShooting().solve
    except ModuleNotFoundError as absent:
        print(f"| elasto-plastic | | not installed: {absent.name} | | | |")
    else:
        peers = {
            "heyoka": (heyoka, _near, True),
            averaged: (heyoka, lambda _, p: _averaged(p), True),
        }
        _compare("elasto-plastic", arguments.points, min(arguments.points, 1024), peers)
    radau = {"SciPy Radau": (scipy_radau, _near, False)}
    _compare("rice-ruina", min(arguments.points, 200), min(arguments.points, 3), radau)


if __name__ == "__main__":
    main()
