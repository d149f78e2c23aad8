"""The verdict of slices: ready, or one thing to do."""

from machine.dryrun.findings import Finding
from machine.workbench.web.snapshot import SLICE_AGAIN, SUPPORT_ON, verdict_of
from profiles.profile import load


def finding(severity: str, code: str, message: str) -> Finding:
    return Finding("error" if severity == "error" else "warning", code, 1, 1, 1, message)


CRASH = finding("error", "collision", "the nozzle touches the part")
UNCALIBRATED = finding("warning", "uncalibrated", "measure it")


def test_slices_without_findings_are_ready() -> None:
    verdict = verdict_of((), load(), 0.0, out_of_date=False)
    assert (verdict.kind, verdict.text, verdict.remedy) == ("ready", "Ready to print", None)


def test_warnings_do_not_keep_it_from_being_printed() -> None:
    assert verdict_of((UNCALIBRATED,), load(), 0.0, out_of_date=False).text == "Ready to print; 1 warning below"


def test_the_first_error_is_the_problem_and_says_which_finding_it_is() -> None:
    verdict = verdict_of((UNCALIBRATED, CRASH, CRASH), load(), 0.0, out_of_date=False)
    assert (verdict.kind, verdict.finding) == ("problem", 1)
    assert verdict.text == "2 problems, the first: the nozzle touches the part"
    assert verdict_of((CRASH,), load(), 0.0, out_of_date=False).text == "1 problem: the nozzle touches the part"


def test_what_hangs_gets_a_button_that_switches_support_on_where_it_is_off() -> None:
    off = load(settings=["process.support=none"])
    verdict = verdict_of((UNCALIBRATED,), off, 812.4, out_of_date=False)
    assert (verdict.text, verdict.remedy) == ("Ready to print, but 812 mm2 hang over without support", SUPPORT_ON)
    assert verdict_of((), load(), 812.4, out_of_date=False).remedy is None
    assert verdict_of((), off, 0.5, out_of_date=False).remedy is None


def test_slices_of_another_bench_are_to_be_made_again() -> None:
    verdict = verdict_of((CRASH,), load(), 0.0, out_of_date=True)
    assert (verdict.kind, verdict.remedy) == ("stale", SLICE_AGAIN)
