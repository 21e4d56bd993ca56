"""Normal equations summed over blocks, and a lock-in that reads a recording in pieces."""

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.lock_in.demodulation import LockInStream, lock_in
from asperity.lock_in.noise import _at_lines
from asperity.lock_in.normal_equations import Basis, even_step, join, merged, sums
from asperity.lock_in.reference import window_basis

TIME = 3.0 + np.arange(20_011) * 1e-3
BASIS = Basis(2 * np.pi * 61.3, 3, 2, 13.0, 10.005)


def plain(basis, time):
    """The columns of the basis by their definition."""
    u = (time - basis.centre) / basis.half_width
    phi = basis.omega * (time - basis.centre)
    k = np.arange(1, basis.harmonics + 1)[:, None]
    waves = np.concatenate([np.cos(k * phi), np.sin(k * phi)])
    drift = np.stack([u**j for j in range(basis.degree + 1)])
    return np.concatenate([drift, waves, u * waves])


def channels(time):
    rng = np.random.default_rng(0)
    return [rng.standard_normal(time.size), np.cos(2 * np.pi * 61.3 * time)]


def test_columns_are_those_of_their_definition() -> None:
    assert abs(BASIS.columns(TIME) - plain(BASIS, TIME)).max() < 1e-11


@pytest.mark.parametrize("blocks", [1, 7, 300, 6000])
@pytest.mark.parametrize("tables", [True, False])
def test_sums_of_blocks_add_up_to_those_of_the_whole(blocks, tables) -> None:
    step = even_step(TIME, BASIS.omega * 3) if tables else None
    assert (step is not None) == tables
    columns, values = plain(BASIS, TIME), channels(TIME)
    block_sums = sums(BASIS, TIME, values, blocks=blocks, step=step)
    gram, moments = block_sums.totals()
    assert abs(gram - columns @ columns.T).max() < 1e-9 * TIME.size / 1e3
    assert abs(moments - columns @ np.stack(values, axis=1)).max() < 1e-8
    assert block_sums.count.sum() == TIME.size
    assert block_sums.middle @ block_sums.count / TIME.size == pytest.approx(TIME.mean(), rel=1e-12)


def test_the_last_blocks_have_the_columns_of_their_own_window() -> None:
    values = channels(TIME)
    last = sums(BASIS, TIME, values, blocks=7)
    first = int(last.count[:3].sum())
    own = window_basis(TIME[first:], BASIS.omega, BASIS.harmonics, BASIS.degree)
    gram, moments = last.after(3, own).totals()
    columns = plain(own, TIME[first:])
    assert abs(gram - columns @ columns.T).max() < 1e-9 * TIME.size / 1e3
    expected = columns @ np.stack([channel[first:] for channel in values], axis=1)
    assert abs(moments - expected).max() < 1e-8


def test_lines_of_a_spectrum_are_sums_of_their_exponentials() -> None:
    rng = np.random.default_rng(3)
    at = np.sort(rng.uniform(-0.5, 0.5, 300))
    residual = rng.standard_normal((300, 2)) + 1j * rng.standard_normal((300, 2))
    for steps in (np.array([40, -37, 3, 7, 81]), np.array([5]), np.arange(2, 98)):
        expected = np.exp(-1j * np.pi * np.outer(steps, at)) @ residual
        np.testing.assert_allclose(_at_lines(steps, at, residual), expected, atol=1e-11)


def jittering(time):
    return time + 2e-4 * np.random.default_rng(1).uniform(-1, 1, time.size)


def with_gaps(time):
    return jittering(np.where(time > 9, time + 0.7004, time))


def at_random(time):
    return np.sort(np.random.default_rng(2).uniform(time[0], time[-1], time.size))


@pytest.mark.parametrize("clock", [jittering, with_gaps, at_random])
@pytest.mark.parametrize("harmonics", [1, 4, 40])
@pytest.mark.parametrize("degree", [0, 1, 2])
def test_sums_over_uneven_clocks_are_those_of_the_definition(clock, harmonics, degree) -> None:
    time = clock(TIME)
    half = float(time[-1] - time[0]) / 2
    basis = Basis(2 * np.pi * 6.3, harmonics, degree, float(time[0]) + half, half)
    columns, values = plain(basis, time), channels(time)
    block_sums = sums(basis, time, values, blocks=3)
    cuts = np.cumsum(block_sums.count[:-1]).astype(int)
    # Rounding of phases of up to 400 rad times the harmonic, per sample.
    allowed = 1e-12 * harmonics * block_sums.count[0]
    for gram, moments, part, *parts in zip(
        block_sums.gram,
        block_sums.moments,
        np.split(columns, cuts, axis=1),
        *(np.split(v, cuts) for v in values),
        strict=True,
    ):
        assert abs(gram - part @ part.T).max() < allowed
        assert abs(moments - part @ np.stack(parts, axis=1)).max() < allowed


def test_merged_blocks_have_the_same_sums() -> None:
    block_sums = sums(BASIS, TIME, channels(TIME), blocks=900)
    fewer = merged(block_sums, 50)
    assert 45 <= fewer.count.size <= 55
    for a, b in zip(block_sums.totals(), fewer.totals(), strict=True):
        assert a == pytest.approx(b, rel=1e-9, abs=1e-9)


def test_joined_pieces_have_the_sums_of_the_whole() -> None:
    whole = sums(BASIS, TIME, channels(TIME), blocks=64)
    values = channels(TIME)
    pieces = join(
        [
            sums(BASIS, TIME[a:b], [v[a:b] for v in values], blocks=5)
            for a, b in ((0, 5000), (5000, 5001), (5001, 20_011))
        ]
    )
    for a, b in zip(whole.totals(), pieces.totals(), strict=True):
        assert a == pytest.approx(b, rel=1e-9, abs=1e-9)


def test_a_clock_is_even_up_to_a_small_phase() -> None:
    assert even_step(TIME, BASIS.omega) == pytest.approx(1e-3)
    late = TIME.copy()
    late[7000] += 1e-7
    assert even_step(late, BASIS.omega) is None


def test_a_stream_gives_the_reading_of_one_call(truth) -> None:
    rng = np.random.default_rng(4)
    time = np.arange(30_000) * 1e-3
    load = truth.load(time) + 0.02 * rng.standard_normal(time.size)
    force = truth.force(time) + 0.01 * rng.standard_normal(time.size)
    whole = lock_in(time, load, force)
    stream = LockInStream(whole.frequency, start=time[0], end=time[-1])
    for piece in np.array_split(np.arange(time.size), 17):
        stream.add(time[piece], load[piece], force[piece])
    reading = stream.read()
    assert abs(reading.harmonics - whole.harmonics).max() < 1e-14
    assert reading.frequency == pytest.approx(whole.frequency, rel=1e-13)
    assert reading.mean_friction == pytest.approx(whole.mean_friction, rel=1e-13)
    # Other blocks give slightly other noise between the harmonics.
    for name in ("W0", "frequency", "mu1", "mu2", "mean_friction"):
        assert reading.uncertainty(name) == pytest.approx(whole.uncertainty(name), rel=0.02)


@pytest.mark.parametrize("detrend", ["none", "linear", "quadratic"])
def test_a_stream_that_is_not_finished_is_read_as_far_as_it_goes(truth, detrend) -> None:
    time = np.arange(30_000) * 1e-3
    rng = np.random.default_rng(4)
    load = truth.load(time) + 0.02 * rng.standard_normal(time.size)
    force = truth.force(time) + 0.05 * time + 0.01 * rng.standard_normal(time.size)
    first = slice(10_000)
    whole = lock_in(time[first], load[first], force[first], detrend=detrend)
    stream = LockInStream(whole.frequency, start=time[0], end=time[-1], detrend=detrend)
    stream.add(time[first], load[first], force[first])
    reading = stream.read()
    assert (reading.start, reading.end) == pytest.approx((whole.start, whole.end))
    assert reading.periods == pytest.approx(whole.periods)
    assert reading.mean_force == pytest.approx(whole.mean_force, rel=1e-12)
    assert reading.mean_friction == pytest.approx(whole.mean_friction, rel=1e-12)
    np.testing.assert_allclose(reading.drift[:, :1], whole.drift[:, :1], atol=1e-2)
    np.testing.assert_allclose(reading.drift_range, whole.drift_range, atol=1e-9)
    assert (reading.drift_uncertainty >= 0).all()
    cycles = reading.cycles(time[first]) - whole.cycles(time[first])
    np.testing.assert_allclose(cycles - np.rint(cycles), 0, atol=1e-9)


def test_a_stream_corrects_its_frequency_to_first_order(truth) -> None:
    time = np.arange(30_000) * 1e-3
    error = 1e-2 / (np.pi * 30)  # Hz: a hundredth of a radian at the ends
    stream = LockInStream(truth.frequency + error, start=time[0], end=time[-1])
    stream.add(time, truth.load(time), truth.force(time))
    reading = stream.read()
    # The relative error that is left is the phase error at the ends.
    assert abs(reading.frequency - truth.frequency) < 1e-2 * error
    assert abs(reading.harmonics[0] - truth.harmonics[0]) < 1e-4 * abs(truth.harmonics[0])


def test_a_stream_refuses_bad_input_and_a_wrong_frequency(truth) -> None:
    time = np.arange(30_000) * 1e-3
    load, force = truth.load(time), truth.force(time)
    stream = LockInStream(truth.frequency * (1 + 2e-4), start=0.0, end=time[-1])
    with pytest.raises(InputError, match="must be called before read"):
        stream.read()
    stream.add(time, load, force)
    with pytest.raises(InputError, match="start again with that"):
        stream.read()
    with pytest.raises(InputError, match="must get times from"):
        stream.add(time + 1, load, force)
    with pytest.raises(InputError, match=r"LockInStream\.add must be finite"):
        stream.add(time, load, np.where(time == time[100], np.nan, force))
    with pytest.raises(InputError, match=r"LockInStream\.add must have one length"):
        stream.add(time[:-1], load, force)
    with pytest.raises(InputError, match="end must follow start"):
        LockInStream(60.0, start=1.0, end=0.0)
    with pytest.raises(InputError, match="detrend must be"):
        LockInStream(60.0, start=0.0, end=1.0, detrend="cubic")


@pytest.mark.parametrize("jitter", [0.0, 1e-4])
@pytest.mark.parametrize("frequency", [60.013, 0.0713, 471.3])
def test_a_long_recording_is_read_exactly(truth, jitter, frequency) -> None:
    truth = truth.but(frequency=frequency)
    rng = np.random.default_rng(0)
    time = np.arange(140_000) * 5e-4
    time = time + jitter * rng.uniform(-1, 1, time.size)
    reading = lock_in(time, truth.load(time), truth.force(time), harmonics=2)
    assert abs(reading.harmonics - truth.harmonics).max() < 1e-12
    assert reading.frequency == pytest.approx(frequency, rel=1e-12)


def test_a_long_recording_whose_frequency_wanders_is_still_read(truth) -> None:
    # Parts of it have other frequencies than the whole.
    time = np.arange(140_000) * 5e-4
    phase = 2 * np.pi * 60 * time + 3.0 * np.cos(2 * np.pi * time / 70)
    load = 7 * (1 + 0.2 * np.cos(phase))
    reading = lock_in(time, load, 0.4 * load, harmonics=1)
    assert reading.harmonics[0] == pytest.approx(0.4 * reading.epsilon, rel=1e-9)
