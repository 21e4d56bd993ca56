"""Long computations, each in a process of its own that reports progress and can be ended."""
