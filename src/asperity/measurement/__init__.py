"""From a recording to numbers with uncertainties and verdicts: windows, segments, levels."""
