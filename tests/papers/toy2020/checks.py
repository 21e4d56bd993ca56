"""What is computed for each claim."""

import math

from asperity.papers.ledger import CheckResult, check


@check("frequency")
def frequency(numbers):
    value = math.sqrt(numbers.K / numbers.M) / (2 * math.pi)
    return CheckResult({"frequency": value}, f"{value:.3f} Hz")


@check("weight")
def weight(numbers):
    value = 9.80665 * numbers.M
    return CheckResult({"weight": value}, f"{value:.1f} N")
