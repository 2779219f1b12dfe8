"""Long work in shares: who does them, and the file that keeps each as it is done."""
