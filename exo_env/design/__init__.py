"""Design by gradient: attachment points, guide and cuff of a device that lower a load over patients who wear it."""
