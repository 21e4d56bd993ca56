"""Piecewise polynomial collocation with Newton's method on the whole orbit: the robust method."""
