"""How many inputs the fuzz tests try: 300 a reader, always the same ones; 10,000 others where EXO_FUZZ=deep."""

import os
import re

from hypothesis import HealthCheck, settings

# Time is bounded by the tests themselves, in seconds of the processor: other programs may slow the clock down.
COMMON = {
    "deadline": None,
    "database": None,
    "suppress_health_check": [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.function_scoped_fixture],
}
settings.register_profile("quick", max_examples=300, derandomize=True, **COMMON)
settings.register_profile("deep", max_examples=10_000, print_blob=True, **COMMON)
settings.load_profile(os.environ.get("EXO_FUZZ", "quick"))

INPUTS = "inputs"


def pytest_runtest_teardown(item):
    """Keep how many inputs a test has tried; hypothesis says it in words."""
    said = getattr(item, "hypothesis_statistics", "")
    counts = re.findall(r"(\d+) (?:passing|failing|invalid)", said)
    item.user_properties.append((INPUTS, sum(map(int, counts))))


def pytest_terminal_summary(terminalreporter):
    """The count of all inputs."""
    reports = [r for group in terminalreporter.stats.values() for r in group if getattr(r, "when", "") == "teardown"]
    tried = [value for r in reports for name, value in r.user_properties if name == INPUTS]
    if sum(tried):
        terminalreporter.write_line(f"fuzz: {sum(tried)} inputs to {sum(n > 0 for n in tried)} readers")
