"""From declarations to one sparse system: layout, tables, sparsity, residual, sensing (paper eq. 1 to 6)."""
