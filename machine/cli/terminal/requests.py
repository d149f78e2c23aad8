"""Requests of the commands: dataclasses whose fields are options of the command line."""

from dataclasses import dataclass
from os.path import exists  # pathlib's raises for a name that is too long
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from machine.cli.terminal import options
from machine.cli.terminal.options import option
from machine.pipeline.requests import BAUD, UPLOAD_MIB, Given, ModelRequest, Outputs

if TYPE_CHECKING:
    from mdp.batch.pool import Workers
    from profiles.profile import Profile

Replace = Annotated[bool, option("--replace", "overwrite existing files")]


@dataclass(frozen=True)
class DecomposeOptions:
    """Files that decompose reads and writes besides the model."""

    out: Annotated[Path | None, option("-o --out DIR", "folder for part-NN.stl, 3MF, JSON")] = None
    plan: Annotated[Path | None, option("--plan FILE", "cut by FILE without a search if it exists; otherwise write it")] = None
    planes: Annotated[Path | None, option("--planes FILE", "planes by hand, cut first; the search finds the others")] = None
    json: options.JsonFile = None
    png: Annotated[Path | None, option("--png FILE", "picture of the parts")] = None
    sheet: Annotated[Path | None, option("--sheet FILE", "picture of the print order, tilted as printed")] = None
    front: Annotated[Path | None, option("--front FILE", "picture of the best cuts for each number of parts")] = None
    html: options.HtmlFile = None
    record: Annotated[Path | None, option("--record FILE", "record of the search, as .npz for training")] = None
    compare: Annotated[bool, option("--compare", "slice the parts: report joints, time and material, also in one part")] = False

    def request(self, model: str, search: options.FileOptions, given: options.ProfileOptions) -> ModelRequest:
        """The request for a model: an existing plan defines the cuts, otherwise the plan is written."""
        known = self.plan if self.plan is not None and exists(self.plan) else None
        outputs = Outputs(
            folder=self.out,
            json=self.json,
            html=self.html,
            png=self.png,
            sheet=self.sheet,
            front=self.front,
            record=self.record,
            plan=None if known else self.plan,
        )
        plans = (known,) if known else ()
        return options.model_request(model, search, given, outputs=outputs, plans=plans, planes=self.planes, compare=self.compare)


@dataclass(frozen=True)
class ExportOptions:
    """Files that export writes besides the G-code."""

    json: options.JsonFile = None
    svg: Annotated[Path | None, option("--svg FILE", "picture of one layer, see --layer")] = None
    html: options.HtmlFile = None
    layer: Annotated[str | None, option("--layer PART:LAYER", "layer to draw; default: the first, 1:1")] = None
    compare: Annotated[bool, option("--compare", "also report time, material, support and risky area in one part")] = False
    force: options.Force = False


@dataclass(frozen=True, kw_only=True)
class EditRequest:
    """Options of edit. model: the model, plan or project to open first; lan: also open it to the local network."""

    model: Annotated[
        str | None, typer.Argument(metavar="[MODEL|PLAN]", show_default=False, help="a model file, demo:NAME, or a plan (.toml)")
    ] = None
    port: Annotated[int, option("--port N", "port of the page; default: any free one", min=0, max=65535, show_default=False)] = 0
    no_browser: options.NoBrowser = False
    upload_mib: Annotated[int, option("--upload-mib N", "size limit of uploaded files, MiB", min=1, max=1024)] = UPLOAD_MIB
    lan: Annotated[bool, option("--lan", "open it to devices of the local network, too, each paired by a code shown here")] = (
        False
    )
    certificate: Annotated[Path | None, option("--certificate FILE", "PEM file: encrypts --lan, with --key")] = None
    key: Annotated[Path | None, option("--key FILE", "PEM file: the key of the certificate")] = None
    given: options.ProfileOptions


@dataclass(frozen=True, kw_only=True)
class BatchRequest:
    """Options of batch. do: decompose, export or estimate; out: folder for the table and the files."""

    folder: Annotated[Path, typer.Argument(metavar="FOLDER", show_default=False, help="folder of models")]
    out: Annotated[Path, option("-o --out DIR", "folder for DO.csv, with a row per model, and the files")]
    do: Annotated[str, option("--do decompose|export|estimate", "what to do with each model; estimate: only the row")] = "export"
    scheduler: Annotated[
        str | None, option("--scheduler ADDRESS", "dask scheduler whose workers do the work: tcp://HOST:8786")
    ] = None
    processes: Annotated[int | None, option("--workers N", "local processes; default: one per core", min=1, max=1024)] = None
    retries: Annotated[int, option("--retries N", "how often to retry a model whose process was killed", min=0, max=100)] = 2
    limit_s: Annotated[float | None, option("--limit-s SECONDS", "abandon a model that takes longer", min=1.0)] = None
    search: options.SearchOptions
    given: options.ProfileOptions

    def asked(self) -> ModelRequest:
        """The request for each model, without the model's name."""
        return options.model_request("", self.search, self.given)

    def workers(self) -> "Workers":
        """The workers that do the work."""
        from mdp.batch.pool import Workers
        from mdp.kernels.threads import THREADS

        return Workers(self.scheduler, self.processes or THREADS, self.retries, self.limit_s)


@dataclass(frozen=True)
class WatchOptions:
    """Options of the page that follows and controls a print."""

    watch: Annotated[bool, option("--watch", "open a page on this computer that follows and controls the print")] = False
    watch_port: Annotated[int | None, option("--watch-port N", "port of the page; default: any free one", min=0, max=65535)] = (
        None
    )
    no_browser: options.NoBrowser = False

    @property
    def port(self) -> int | None:
        """Port of the page, 0: any free one; None: no page."""
        return (self.watch_port or 0) if self.watch or self.watch_port is not None else None


@dataclass(frozen=True)
class PrintOptions:
    """Options of print: how it is recorded and watched, and the speed of a simulated printer."""

    baud: options.Baud = BAUD
    speed: options.SimSpeed = 0.0
    watching: WatchOptions = WatchOptions()
    log: options.LogFile = None
    journal: Annotated[Path | None, option("--journal FILE", "journal for resume; default: a new file in the state folder")] = (
        None
    )
    force: options.ForceAll = False


@dataclass(frozen=True)
class ResumeOptions:
    """Options of resume. further: journal of the rest."""

    journal: Annotated[
        Path | None, typer.Argument(metavar="[JOURNAL]", help="journal of the interrupted print; without it all are listed")
    ] = None
    port: Annotated[str | None, option("--port PORT", "serial port")] = None
    baud: options.Baud = BAUD
    yes: Annotated[bool, option("--yes", "continue without asking if nothing is in doubt")] = False
    watching: WatchOptions = WatchOptions()
    further: Annotated[Path | None, option("--journal FILE", "journal of the rest; default: a new file in the state folder")] = (
        None
    )
    log: options.LogFile = None
    machine: Annotated[str | None, options.profile_option("machine", "; default: that of the journal")] = None


@dataclass(frozen=True)
class MachineOptions:
    """A machine and settings over it, for commands that use nothing else of a profile."""

    machine: options.MachineName = Given.machine
    settings: options.Settings = ()

    def profile(self) -> "Profile":
        """The machine's profile. Raises ProfileError."""
        return options.machine_profile(self.machine, self.settings)


@dataclass(frozen=True, kw_only=True)
class ConsoleRequest:
    """Options of console. reports: show temperature reports."""

    port: options.PortOrSim
    baud: options.Baud = BAUD
    sim_speed: options.SimSpeed = 0.0
    reports: Annotated[bool, option("--reports/--no-reports", "show temperatures that the printer reports")] = True
    leave_heaters: Annotated[
        bool, option("--leave-heaters", "leave the heaters as they are; default: switch them off at the end")
    ] = False
    log: options.LogFile = None
    given: MachineOptions = MachineOptions()


@dataclass(frozen=True)
class SimulatorRequest:
    """Options of simulator. link: symbolic link to the pseudo-terminal; tcp: port instead of a terminal; faults: fault script.

    ball: X,Y,Z,D of a ball on the plate; true_machine: the machine that the probe senses. Either of them adds a probe.
    """

    link: Annotated[Path | None, option("--pty PATH", "symbolic link to the pseudo-terminal")] = None
    tcp: Annotated[int | None, option("--tcp PORT", "for socket://localhost:PORT; 0: a free one")] = None
    faults: Annotated[Path | None, option("--faults FILE", "fault script: what goes wrong")] = None
    speed: Annotated[float, option("--speed X", "X times real time; 0: as fast as possible")] = 1.0
    baud: Annotated[int | None, option("--baud N", "simulate the speed of a line of N bits/s")] = None
    habits: Annotated[str | None, option("--habits LIST", "how the firmware was built: no-advanced-ok,no-busy,...")] = None
    ball: Annotated[str | None, option("--ball X,Y,Z,D", "add a probe and a ball on the plate: centre and diameter, mm")] = None
    true_machine: Annotated[str | None, option("--true-machine NAME|FILE", "machine that the probe senses")] = None
    given: MachineOptions = MachineOptions()


@dataclass(frozen=True)
class ProbeOptions:
    """Options of calibrate with a probe and a ball on the plate."""

    probe: Annotated[bool, option("--probe", "the machine at --port measures a ball on its plate by itself")] = False
    port: Annotated[str | None, option("--port PORT|sim", "serial port of the machine to measure; sim: simulated")] = None
    baud: options.Baud = BAUD
    ball_mm: Annotated[float, option("--ball-mm MM", "diameter of the ball", min=4, max=60)] = 20.0
    probe_offset: Annotated[
        str, option("--probe-offset X,Y,Z", "from the nozzle's tip to the contact point; 0,0,0: the nozzle senses")
    ] = "0,0,0"
    png: Annotated[Path | None, option("--png FILE", "with --probe: picture of the residuals")] = None
    log: options.LogFile = None

    @property
    def offset_mm(self) -> tuple[float, float, float]:
        """From the nozzle's tip to the contact point, 0 for the nozzle itself. Raises BadParameter."""
        try:
            x, y, z = (float(word) for word in self.probe_offset.split(","))
        except ValueError:
            raise typer.BadParameter(f"--probe-offset {self.probe_offset}: three numbers X,Y,Z in mm are expected") from None
        if not all(-200.0 <= value <= 200.0 for value in (x, y, z)):
            raise typer.BadParameter(f"--probe-offset {self.probe_offset}: -200 to 200 mm are allowed")
        return x, y, z


@dataclass(frozen=True)
class CalibrationRequest:
    """Options of calibrate: machine, mark (None: the default), and where the result goes.

    save: name of the user's own profile, None: the machine's. replace: overwrite files. force: save despite large residuals.
    directions: also find the directions of the axes.
    """

    out: Annotated[Path | None, option("-o --out OUT.gcode", "program to write, with a sheet beside it to fill in")] = None
    measured: Annotated[Path | None, option("--measured FILE", "filled sheet, .toml or .csv: compute the axes")] = None
    mark_height_mm: Annotated[float | None, option("--mark-height MM", "height of the mark over the plate", min=0, max=200)] = (
        None
    )
    mark_radius_mm: Annotated[float | None, option("--mark-radius MM", "distance of the mark from the middle of the plate")] = (
        None
    )
    printed: Annotated[
        tuple[Path, ...], option("--printed FILE.gcode", "program of demo:calibration that was printed; repeatable")
    ] = ()
    readings: Annotated[
        tuple[str, ...], option("--readings TEXT", "for each --printed: right,up,height of its four pads; default: ask")
    ] = ()
    html: Annotated[Path | None, option("--html FILE", "with --printed: page to type the readings on")] = None
    save: Annotated[str | None, option("--save NAME", "name of your profile; default: the machine's")] = None
    replace: Replace = False
    force: Annotated[bool, option("--force", "save although touches or readings are far off")] = False
    directions: Annotated[bool, option("--directions", "also find the directions of the axes")] = False
    probing: ProbeOptions = ProbeOptions()
    given: MachineOptions = MachineOptions()


@dataclass(frozen=True, kw_only=True)
class CouponRequest:
    """Options of coupon. shape: how the bars are broken; vary: KEY=VALUE of half of the bars, none: the usual ones.

    html, png: views of the bars; report: only write a table; save: name of the user's own material and process, None: theirs.
    replace: overwrite files. force: write the program despite errors of its dry run.
    """

    out: Annotated[Path | None, option("-o --out OUT.gcode", "program to write, with a sheet beside it to fill in")] = None
    measured: Annotated[Path | None, option("--measured FILE", "filled sheet, .toml: evaluate it and save the result")] = None
    report: Annotated[Path | None, option("--report FILE.md", "with --measured: only write a table; - for standard output")] = (
        None
    )
    shape: Annotated[str, option("--shape bend|tensile", "bars for a luggage scale, or ISO 527-2 type 5A")] = "bend"
    vary: Annotated[
        tuple[str, ...], option("--vary KEY=VALUE", "setting of half of the bars, replaces the usual four; repeatable, at most 5")
    ] = ()
    html: options.HtmlFile = None
    png: Annotated[Path | None, option("--png FILE", "picture of the bars in print order")] = None
    save: Annotated[str | None, option("--save NAME", "name of your material and process profiles; default: the originals'")] = (
        None
    )
    replace: Replace = False
    force: options.Force = False
    given: options.DefaultProfileOptions


@dataclass(frozen=True)
class ImportRequest:
    """Options of profiles import: file, and presets of a bundle (empty: the only or the active one)."""

    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="config.ini, bundle or G-code of PrusaSlicer; JSON of OrcaSlicer; .curaprofile")
    ]
    process: Annotated[str, option("--process-preset NAME", "print preset of a bundle")] = ""
    material: Annotated[str, option("--material-preset NAME", "filament preset of a bundle")] = ""
    printer: Annotated[str, option("--printer-preset NAME", "printer preset of a bundle, for its nozzle")] = ""
    name: Annotated[str, option("--name NAME", "name of both profiles; default: that of the file")] = ""
    out: Annotated[Path | None, option("-o --out FOLDER", "folder to write to; default: your own profiles")] = None
    replace: Replace = False
    json: Annotated[bool, option("--json", "report the result for each setting as JSON")] = False


@dataclass(frozen=True)
class DetectRequest:
    """Options of profiles detect. base: profile to inherit, None: the nearest shipped one; out: file to write, None: in the
    user's own folder; replace: overwrite it."""

    file: Annotated[
        Path | None,
        typer.Argument(metavar="FILE", help="printer.cfg, config.g, a log of M503, a dump of $$, LinuxCNC's .ini"),
    ] = None
    port: Annotated[str | None, option("--port PORT", "port of a printer; moonraker:HOST, duet:HOST; or sim")] = None
    baud: options.Baud = BAUD
    base: Annotated[str | None, option("--base NAME", "profile to inherit; default: the nearest shipped one")] = None
    out: Annotated[Path | None, option("-o --out FILE.toml", "profile to write; default: one of your own")] = None
    replace: Replace = False
    json: Annotated[bool, option("--json", "report as JSON what was found, what was not, and what to measure")] = False
