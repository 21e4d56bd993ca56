"""What is computed for each claim."""

import math

from asperity.ledger import check


@check("frequency")
def frequency(numbers):
    return {"frequency": math.sqrt(numbers.K / numbers.M) / (2 * math.pi)}


@check("weight")
def weight(numbers):
    return {"weight": 9.80665 * numbers.M}
