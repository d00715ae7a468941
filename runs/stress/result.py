"""One line of the table: what was tried, what has to hold, how often it held."""

from dataclasses import dataclass, field


@dataclass
class Result:
    """tried   attempts;  failures: one line for each that did not hold;  found: the figures"""

    claim: str
    must: str
    tried: int = 0
    failures: list[str] = field(default_factory=list)
    found: str = ""

    def row(self) -> str:
        """The line of the table."""
        held = f"{self.tried - len(self.failures)} of {self.tried}"
        return f"| {self.claim} | {self.must} | {held} | {self.found} |"
