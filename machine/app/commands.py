"""Commands: what decompose, export, simulate and print do; each returns an exit code and never sees the parser."""

from dataclasses import asdict, replace
from pathlib import Path

from machine.app.compare import Rival, compare_table, compared, plain
from machine.app.foot import in_words, told_in
from machine.app.layer_picture import asked, drawn
from machine.app.match import check_printer, check_program
from machine.app.output import STDOUT, check_folder, check_writable, make_folder, write_bytes, write_json, write_lines
from machine.app.picture import contact_sheet, parts_picture
from machine.app.pipeline import Program, build, decompose_model, model_name
from machine.app.png import write_png
from machine.app.printing import check_dialect, check_port, paced, print_program
from machine.app.progress import say
from machine.app.report import agreement_line, parts_table, run_table, show
from machine.app.view.live import served
from machine.app.view.page import parts_page, print_page
from machine.app.warmup import warm_dry_run, warm_picture
from machine.dryrun.agreement import Agreement, agreement
from machine.dryrun.dryrun import dry_run, summary
from machine.dryrun.starvation import check_baud, starved
from mdp.read import check_file, locate, read_mesh
from mdp.save import part_file, stl, threemf, values
from profiles.errors import GcodeError, MoveError, OutputError, ProfileError
from profiles.profile import Profile

GCODE_SUFFIXES = {".gcode", ".gco", ".g", ".nc", ".ngc"}


def decompose(
    model: str,
    profile: Profile,
    ranker: str,
    orient: bool,
    out: Path | None,
    json: Path | None,
    png: Path | None,
    sheet: Path | None,
    record: Path | None,
    html: Path | None = None,
) -> int:
    """Find the parts of a model and save what is asked for."""
    if out is not None:
        check_folder(out)
    _check(png, sheet, record, html, json=json)
    found = decompose_model(model, profile, ranker, orient, record)
    told = values(found.decomposition, found.read_s, found.total_s)
    if out is not None:
        make_folder(out)
        for part in found.decomposition.parts:
            write_bytes(out / part_file(part.index), stl(part.mesh))
        write_bytes(out / "decomposition.3mf", threemf(found.decomposition))
        write_json(out / "decomposition.json", told)
    if png is not None or sheet is not None:
        warm_picture()
    if png is not None:
        write_png(png, parts_picture(found.decomposition, profile))
    if sheet is not None:
        write_png(sheet, contact_sheet(found.decomposition, profile.machine))
    if html is not None:
        write_bytes(html, parts_page(found.decomposition, profile))
    if json is not None:
        write_json(json, told)
    if json != STDOUT:
        show(parts_table(found, profile.process.self_supporting_angle_deg, profile.search.count_platform_faces))
    return 0


def export(
    model: str,
    profile: Profile,
    ranker: str,
    orient: bool,
    out: Path,
    json: Path | None,
    svg: Path | None,
    layer: str | None,
    force: bool,
    compare: bool = False,
    html: Path | None = None,
) -> int:
    """Write a model's G-code, and one layer's picture where asked; refused when its dry run finds an error, unless forced.

    out: - is standard output, then the table goes to stderr. compare: tell also what the model costs printed in one part.
    """
    if out == json == STDOUT:
        raise OutputError("-o - and --json -: only one of them can go to standard output")
    _check(html, svg, None if out == STDOUT else out, json=json)
    wanted = asked(layer, svg is not None)
    found = decompose_model(model, profile, ranker, orient, to_build=True).decomposition
    program = build(found, profile, pictures=True)
    _refuse_errors(program, force)
    picture = b"" if svg is None else drawn(program.sliced, *wanted)
    write_lines(out, program.lines)
    if svg is not None:
        write_bytes(svg, picture)
    rivals = compared(program, profile) if compare else ()
    if html is not None:
        write_bytes(html, print_page(model_name(model), program, profile, rivals=rivals))
    _tell(program, json, rivals, aside=out == STDOUT)
    return 0


def simulate(
    model: str,
    profile: Profile,
    ranker: str,
    orient: bool,
    json: Path | None,
    named: frozenset[str] = frozenset(),
    beside: str | None = None,
    html: Path | None = None,
    baud: int | None = None,
) -> int:
    """Dry-run a model or a G-code file; 1 when a finding is an error.

    named: profiles given, not taken from the file. beside: the model that a G-code file's plastic is held against. baud: of a
    line whose speed is judged too.
    """
    _check(html, json=json)
    if baud is not None:
        check_baud(baud)
    if beside is not None:
        if Path(model).suffix.lower() not in GCODE_SUFFIXES:
            raise ProfileError(f"--model {beside}: {model} is a model itself; --model goes with a G-code file")
        check_file(locate(beside))
    given = profile
    program, profile = program_of(model, profile, ranker, orient, named)
    mesh = None if program.decomposition is None else program.decomposition.mesh
    if beside is not None:
        mesh, _ = read_mesh(locate(beside), profile.process.scale, profile.process.rotate_deg)
    found = None
    if mesh is not None:
        found, run = agreement(program.run, mesh, profile)
        program = replace(program, run=run)
    if baud is not None:
        program = replace(program, run=starved(program.run, program.lines, profile.machine, baud))
    if html is not None:
        known = machine_known(program, profile, given, named)
        write_bytes(html, print_page(model_name(model), program, profile, known))
    _tell(program, json, found=found)
    return 1 if program.run.errors else 0


def print_model(
    model: str,
    profile: Profile,
    ranker: str,
    orient: bool,
    port: str,
    baud: int,
    sim_speed: float,
    force: bool,
    named: frozenset[str] = frozenset(),
    watch_port: int | None = None,
    log: Path | None = None,
    journal: Path | None = None,
) -> int:
    """Dry-run, then stream a model or a G-code file to a printer, which is asked who it is before any work is done.

    watch_port: serve the print's page on this port of this computer, 0: on any free one; None: serve nothing.
    log: file for the traffic of the line, journal: for what a resume needs; None: a new one in the state folder.
    """
    _check(log, journal)
    check_baud(baud)
    answer = check_port(port, baud, sim_speed)
    is_model = Path(model).suffix.lower() not in GCODE_SUFFIXES
    if is_model:
        check_dialect(profile.machine)
        check_printer(answer, profile.machine, force)
    program, profile = program_of(model, profile, ranker, orient, named)
    if not is_model:
        check_dialect(profile.machine)
        check_printer(answer, profile.machine, force)
    check_program(answer, program, profile, model_name(model), force)
    _refuse_errors(program, force)
    if paced(port):
        program = replace(program, run=starved(program.run, program.lines, profile.machine, baud))
    show(run_table(program.run))
    name, source = model_name(model), None if is_model else Path(model)
    if watch_port is None:
        return print_program(program, profile, port, baud, sim_speed, name=name, log=log, source=source, journal=journal)
    with served(print_page(model_name(model), program, profile, live=True), watch_port) as watched:
        say(f"watch the print at {watched.address}")
        follow = watched.follow
        code = print_program(program, profile, port, baud, sim_speed, follow, name=name, log=log, source=source, journal=journal)
        watched.end("stopped" if code else "done")
    return code


def program_of(model: str, profile: Profile, ranker: str, orient: bool, named: frozenset[str]) -> tuple[Program, Profile]:
    """The program of a model or of a G-code file, which may tell its own profiles, and the profile it was tried with."""
    if Path(model).suffix.lower() in GCODE_SUFFIXES:
        lines = _gcode_lines(Path(model))
        profile, taken = told_in(lines, profile, named)
        if taken:
            say(f"{Path(model).name}: {in_words(taken, profile)}, as the file itself tells")
        warm_dry_run()
        return Program(lines, dry_run(lines, profile), None), profile
    return build(decompose_model(model, profile, ranker, orient, to_build=True).decomposition, profile), profile


def machine_known(program: Program, profile: Profile, given: Profile, named: frozenset[str]) -> bool:
    """Whether a program's machine is told by its file (profile differs from the one given) or by the user, not guessed."""
    return program.decomposition is not None or "machine" in named or profile.machine is not given.machine


def _gcode_lines(path: Path) -> tuple[str, ...]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise GcodeError(f"G-code file {path} cannot be read: {(error.strerror or str(error)).lower()}") from None
    except UnicodeDecodeError as error:
        raise GcodeError(f"G-code file {path} is not text: byte {error.start} is {error.object[error.start]:#04x}") from None
    lines = tuple(text.removesuffix("\n").split("\n"))  # as GcodeFile counts them, which a resume reads
    if not any(line.strip() for line in lines):
        raise GcodeError(f"G-code file {path} is empty")
    return lines


def _refuse_errors(program: Program, force: bool) -> None:
    errors = program.run.errors
    if not errors:
        return
    if force:
        say(f"the dry run found {len(errors)} errors; going on because of --force")
        return
    raise MoveError(
        f"the dry run found {len(errors)} errors, the first: {errors[0].message} (simulate lists all, --force goes on)"
    )


def _check(*files: Path | None, json: Path | None = None) -> None:
    for file in (*files, None if json == STDOUT else json):
        if file is not None:
            check_writable(file)


def _tell(
    program: Program, json: Path | None, rivals: tuple[Rival, ...] = (), found: Agreement | None = None, aside: bool = False
) -> None:
    """The result as JSON, and as a table; aside: the table goes to stderr."""
    if json is not None:
        told = {"compare": plain(rivals)} if rivals else {}
        write_json(json, summary(program.run) | told | ({"model": asdict(found)} if found is not None else {}))
    if json != STDOUT:
        beside = "" if found is None else agreement_line(found)
        table = run_table(program.run) + beside + (compare_table(rivals) if rivals else "")
        if aside:
            say(table.removesuffix("\n"))
        else:
            show(table)
