"""Problems of the literature and closed forms, solved with the whole core."""
