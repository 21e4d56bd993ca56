"""The plan of a sweep as its file has it, and the operating points that it comes to."""
