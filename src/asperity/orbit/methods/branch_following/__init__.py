"""An orbit followed from steady sliding to the amplitude asked for, through folds."""
