"""Tables of operating points: one point a row in, the same rows with their responses out.

Input columns are SI numbers without units, named ``law, A, B, D0, mu0, V0, K, M, W0, alpha,
lambda, V, epsilon, frequency`` and whatever else a registered law declares. They are written back
as they were read, in their order, followed by `asperity.parameters.RESULT_COLUMNS`. For a row
that cannot be solved ``result`` says why; the other rows are solved. Rows are read, solved and
written in chunks, so that memory does not grow with the table.
"""

from asperity.study.table.run import TableSummary, run_table

__all__ = ["TableSummary", "run_table"]
