"""Prints how many tests of a JUnit file (ctest --output-junit) passed, failed and were skipped, and why those were skipped."""

import re
import sys
import xml.etree.ElementTree as ElementTree


def skip_reason(case: ElementTree.Element) -> str:
    """What the test itself said: GoogleTest prints "FILE:LINE: Skipped", then the message, then "[  SKIPPED ]", scripts a line."""
    if case.get("status") == "disabled":
        return "disabled"
    output = case.findtext("system-out") or ""
    said = re.search(r": Skipped\n(.*?)\n*\[  SKIPPED \]", output, re.DOTALL)
    if said and said.group(1).strip():
        return " ".join(said.group(1).split())
    said = re.findall(r"^skipped: (.+)$", output, re.MULTILINE)  # scripts
    if said:
        return said[-1]
    skipped = case.find("skipped")
    return (skipped.get("message") if skipped is not None else None) or "no reason given"


def main(path: str) -> None:
    cases = list(ElementTree.parse(path).getroot().iter("testcase"))
    skipped = [case for case in cases if case.get("status") in ("notrun", "disabled") or case.find("skipped") is not None]
    failed = [case for case in cases if case.find("failure") is not None]
    passed = len(cases) - len(skipped) - len(failed)
    print(f"==> {len(cases)} tests: {passed} passed, {len(failed)} failed, {len(skipped)} skipped")
    reasons: dict[str, list[str]] = {}
    for case in skipped:
        reasons.setdefault(skip_reason(case), []).append(case.get("name", "?"))
    for reason, names in reasons.items():
        print(f"    skipped: {reason}")
        for name in names:
            print(f"      {name}")


if __name__ == "__main__":
    main(sys.argv[1])
