"""What learns: the algorithms with their arguments, a critic that sees more than the policy, and DAgger."""
