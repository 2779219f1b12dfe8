"""Derivatives of residual and sensors by states, inputs and declared numbers, and what checks them."""
