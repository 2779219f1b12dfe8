"""What solves an implicit stage: Newton's iteration, its matrix, and what keeps the matrix solvable."""
