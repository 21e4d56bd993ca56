"""Options of a measurement, which every file of a campaign shares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from asperity.cli.measure.source import RecordingSource
from asperity.cli.words import in_options
from asperity.errors import InputError, naming

if TYPE_CHECKING:
    from asperity.measurement.measure import Measurement
    from asperity.measurement.sliding.measure import SlidingMeasurement
    from asperity.recording.trace import Trace

Read = TypeVar("Read")


@dataclass(frozen=True)
class ReadingOptions:
    """Options of ``asperity measure`` on what is read.

    Attributes
    ----------
    modulated : bool or None
        Whether the load is; None reads velocity steps and holds where it is constant.
    frequency : float or None
        Hz; None finds it.
    exact_frequency : bool
    harmonics : int
    window : (float, float) or None
        Seconds.
    whole_periods : bool
    detrend : str
    steps : list of float or None
        Seconds.
    holds : list of (float, float) or None
        Seconds.
    """

    modulated: bool | None
    frequency: float | None
    exact_frequency: bool
    harmonics: int
    window: tuple[float, float] | None
    whole_periods: bool
    detrend: str
    steps: list[float] | None = None
    holds: list[tuple[float, float]] | None = None

    def measure(self, trace: Trace) -> tuple[Measurement | SlidingMeasurement, str]:
        """Measure a recording: its longest modulated stretch, or its sliding.

        Returns
        -------
        measurement : Measurement or SlidingMeasurement
        reason : str
            Why the program reads it as sliding, where the options leave that to it.
        """
        from asperity.measurement.measure import measure

        return self.either(trace, lambda: measure(trace, window=self.window, **self._lock_in()))

    def either(self, trace: Trace, modulated: Callable[[], Read]) -> tuple[Any, str]:
        """What `modulated` reads, or the sliding, as the options or the recording say.

        Parameters
        ----------
        trace : Trace
        modulated : callable
        """
        from asperity.measurement.from_file import modulated_or_sliding

        if self.modulated is False:
            return self.sliding(trace), ""
        if self.modulated or self.frequency is not None:
            return modulated(), ""
        return modulated_or_sliding(trace, modulated, lambda: self.sliding(trace))

    def sliding(self, trace: Trace) -> SlidingMeasurement:
        """Measure a recording without modulation."""
        from asperity.measurement.sliding.measure import measure_sliding

        return measure_sliding(
            trace,
            window=self.window,
            detrend=self.detrend,
            steps=self.steps,
            holds=self.holds,
        )

    def amplitudes(self, trace: Trace) -> list[Measurement | InputError]:
        """Measure every modulated stretch of a recording; that of the window, if one is given."""
        from asperity.measurement.measure import measure, measure_amplitudes

        if self.window is not None:
            return [measure(trace, window=self.window, **self._lock_in())]
        return measure_amplitudes(trace, **self._lock_in())

    def _lock_in(self) -> dict[str, Any]:
        return {
            "frequency": self.frequency,
            "harmonics": self.harmonics,
            "detrend": self.detrend,
            "only_whole_periods": self.whole_periods,
            "refine": not self.exact_frequency,
        }


@dataclass(frozen=True)
class FileRows:
    """Measures one file of a campaign; it can be sent to another process.

    Attributes
    ----------
    source : RecordingSource
    options : ReadingOptions
    """

    source: RecordingSource
    options: ReadingOptions

    def __call__(self, path: Path) -> list[dict[str, Any]]:
        """Rows of a file; one row with the reason if it cannot be measured."""
        from asperity.measurement.campaign import failed_row, modulated_rows, sliding_rows

        with naming(in_options):
            try:
                trace = self.source.read(path)
                result, _ = self.options.either(trace, lambda: self.options.amplitudes(trace))
                several = isinstance(result, list)
                return modulated_rows(path, result) if several else sliding_rows(path, result)
            except InputError as error:
                return [failed_row(path, 1, str(error))]
            except Exception as error:  # one damaged file must not cost the others
                reason = f"{type(error).__name__}: {' '.join(str(error).split())}"
                return [failed_row(path, 1, f"the recording could not be measured ({reason})")]

    def inputs(self) -> dict[str, Any]:
        """All that rows depend on besides the files, as JSON values.

        Of a reduction file its contents: a campaign is not resumed with another one.

        Raises
        ------
        InputError
            If the reduction file cannot be read.
        """
        source = asdict(self.source)
        if self.source.recipe is not None:
            from asperity.recording.recipe import load_recipe

            source["recipe"] = load_recipe(self.source.recipe).model_dump()
        return {"source": source, "options": asdict(self.options)}
