"""Commands that fill a table cell by cell: ablations, shifts, and how fast policies get used to a patient."""
