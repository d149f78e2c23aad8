"""Requests: what each command is asked for, as values whose fields are the options of the command line."""

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

Replace = Annotated[bool, option("--replace", "write over a file that exists")]


@dataclass(frozen=True)
class DecomposeOptions:
    """Files that decompose reads and writes besides the model."""

    out: Annotated[Path | None, option("-o --out DIR", "folder for part-NN.stl, 3MF, JSON")] = None
    plan: Annotated[Path | None, option("--plan FILE", "cut by this plan, without a search, if it exists; else write it")] = None
    planes: Annotated[Path | None, option("--planes FILE", "planes to cut first; the search adds others")] = None
    json: options.JsonFile = None
    png: Annotated[Path | None, option("--png FILE", "picture of the parts")] = None
    sheet: Annotated[Path | None, option("--sheet FILE", "picture of the print order, tilted as printed")] = None
    front: Annotated[Path | None, option("--front FILE", "picture of the cuts for every number of parts")] = None
    html: options.HtmlFile = None
    record: Annotated[Path | None, option("--record FILE", "training data of the search, as .npz")] = None
    compare: Annotated[bool, option("--compare", "slice the parts, and show their joints, and time and material in one part")] = (
        False
    )

    def request(self, model: str, search: options.FileOptions, given: options.ProfileOptions) -> ModelRequest:
        """What is asked for of a model: a plan that exists is cut by, another is written."""
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
    layer: Annotated[str | None, option("--layer PART:LAYER", "which layer; 1:1 by default")] = None
    compare: Annotated[bool, option("--compare", "also show time, material and support in one part")] = False
    force: options.Force = False


@dataclass(frozen=True, kw_only=True)
class EditRequest:
    """The workbench. model: a model, a plan or a project to begin with; lan: open it to the local network, too."""

    model: Annotated[
        str | None, typer.Argument(metavar="[MODEL|PLAN]", show_default=False, help="a model file, demo:NAME, or a plan (.toml)")
    ] = None
    port: Annotated[int, option("--port N", "port of the page; else any free one", min=0, max=65535, show_default=False)] = 0
    no_browser: options.NoBrowser = False
    upload_mib: Annotated[int, option("--upload-mib N", "the largest file that a page may send", min=1, max=1024)] = UPLOAD_MIB
    lan: Annotated[bool, option("--lan", "open it to devices of the local network as well, each paired by a code shown here")] = (
        False
    )
    certificate: Annotated[Path | None, option("--certificate FILE", "PEM file: encrypts --lan, with --key")] = None
    key: Annotated[Path | None, option("--key FILE", "PEM file: the key of the certificate")] = None
    given: options.ProfileOptions


@dataclass(frozen=True, kw_only=True)
class BatchRequest:
    """Every model of a folder. do: decompose, export or estimate; out: folder for the table and the files."""

    folder: Annotated[Path, typer.Argument(metavar="FOLDER", show_default=False, help="folder of models")]
    out: Annotated[Path, option("-o --out DIR", "folder for the results and DO.csv, a row for each model")]
    do: Annotated[str, option("--do decompose|export|estimate", "what to make of each; estimate: the table alone")] = "export"
    scheduler: Annotated[str | None, option("--scheduler ADDRESS", "dask scheduler of the workers, as tcp://HOST:8786")] = None
    processes: Annotated[int | None, option("--workers N", "processes here; else one per core", min=1, max=1024)] = None
    retries: Annotated[int, option("--retries N", "how often a model whose process was killed is retried", min=0, max=100)] = 2
    limit_s: Annotated[float | None, option("--limit-s SECONDS", "a model that takes longer is given up", min=1.0)] = None
    search: options.SearchOptions
    given: options.ProfileOptions

    def asked(self) -> ModelRequest:
        """What is asked for of each model, without a model's name."""
        return options.model_request("", self.search, self.given)

    def workers(self) -> "Workers":
        """Where the work is done."""
        from mdp.batch.pool import Workers
        from mdp.kernels.threads import THREADS

        return Workers(self.scheduler, self.processes or THREADS, self.retries, self.limit_s)


@dataclass(frozen=True)
class WatchOptions:
    """The page that follows and commands a print."""

    watch: Annotated[bool, option("--watch", "open a page that follows and controls the print")] = False
    watch_port: Annotated[int | None, option("--watch-port N", "port of that page; else any free one", min=0, max=65535)] = None
    no_browser: options.NoBrowser = False

    @property
    def port(self) -> int | None:
        """Where the page is served, 0: at any free port; None: nowhere."""
        return (self.watch_port or 0) if self.watch or self.watch_port is not None else None


@dataclass(frozen=True)
class PrintOptions:
    """How a print is recorded and watched, and how fast a simulated printer is."""

    baud: options.Baud = BAUD
    speed: options.SimSpeed = 0.0
    watching: WatchOptions = WatchOptions()
    log: options.LogFile = None
    journal: Annotated[Path | None, option("--journal FILE", "for resume; else a new file in the state folder")] = None
    force: options.ForceAll = False


@dataclass(frozen=True)
class ResumeOptions:
    """A print that was cut off, and how its rest is printed; further: the journal of the rest."""

    journal: Annotated[
        Path | None, typer.Argument(metavar="[JOURNAL]", help="journal of the print that was cut off; without it they are listed")
    ] = None
    port: Annotated[str | None, option("--port PORT", "serial port")] = None
    baud: options.Baud = BAUD
    yes: Annotated[bool, option("--yes", "go on without asking, where nothing is in doubt")] = False
    watching: WatchOptions = WatchOptions()
    further: Annotated[Path | None, option("--journal FILE", "journal of the rest; else a new file in the state folder")] = None
    log: options.LogFile = None
    machine: options.MachineGiven = None


@dataclass(frozen=True)
class MachineOptions:
    """A machine and settings over it, where nothing else of a profile matters."""

    machine: options.MachineName = Given.machine
    settings: options.Settings = ()

    def profile(self) -> "Profile":
        """The profile. Raises ProfileError."""
        return options.machine_profile(self.machine, self.settings)


@dataclass(frozen=True, kw_only=True)
class ConsoleRequest:
    """A printer to talk to line by line. reports: show temperature reports; log as for a print."""

    port: options.PortOrSim
    baud: options.Baud = BAUD
    sim_speed: options.SimSpeed = 0.0
    reports: Annotated[bool, option("--reports/--no-reports", "show temperatures that the printer reports")] = True
    leave_heaters: Annotated[
        bool, option("--leave-heaters", "heaters stay as they are on leaving; else they are switched off")
    ] = False
    log: options.LogFile = None
    given: MachineOptions = MachineOptions()


@dataclass(frozen=True)
class SimulatorRequest:
    """A simulated printer for other hosts. link: kept on the terminal's path; tcp: port instead of a terminal; faults: script.

    ball: X,Y,Z,D of one on its plate, true_machine: what its probe senses; with either of them it has a probe.
    """

    link: Annotated[Path | None, option("--pty PATH", "a link to keep on the terminal's path")] = None
    tcp: Annotated[int | None, option("--tcp PORT", "for socket://localhost:PORT; 0: a free one")] = None
    faults: Annotated[Path | None, option("--faults FILE", "fault script: what goes wrong")] = None
    speed: Annotated[float, option("--speed X", "X times real time; 0: as fast as possible")] = 1.0
    baud: Annotated[int | None, option("--baud N", "bytes are as slow as on such a line")] = None
    habits: Annotated[str | None, option("--habits LIST", "how the firmware was built: no-advanced-ok,no-busy,...")] = None
    ball: Annotated[str | None, option("--ball X,Y,Z,D", "it has a probe, and a ball on the plate: centre and diameter, mm")] = (
        None
    )
    true_machine: Annotated[str | None, option("--true-machine NAME|FILE", "what its probe senses is this machine's")] = None
    given: MachineOptions = MachineOptions()


@dataclass(frozen=True)
class ProbeOptions:
    """A machine that measures a ball on its plate by itself."""

    probe: Annotated[bool, option("--probe", "the machine at --port measures a ball on its plate by itself")] = False
    port: Annotated[str | None, option("--port PORT|sim", "serial port of the machine to measure; sim: simulated")] = None
    baud: options.Baud = BAUD
    ball_mm: Annotated[float, option("--ball-mm MM", "diameter of the ball", min=4, max=60)] = 20.0
    probe_offset: Annotated[
        str, option("--probe-offset X,Y,Z", "from the nozzle's tip to what touches; 0,0,0: the nozzle senses")
    ] = "0,0,0"
    png: Annotated[Path | None, option("--png FILE", "of --probe: picture of what is left over")] = None
    log: options.LogFile = None

    @property
    def offset_mm(self) -> tuple[float, float, float]:
        """From the nozzle's tip to what touches; 0 where the nozzle senses. Raises BadParameter."""
        try:
            x, y, z = (float(word) for word in self.probe_offset.split(","))
        except ValueError:
            raise typer.BadParameter(f"--probe-offset {self.probe_offset}: three numbers X,Y,Z in mm are expected") from None
        if not all(-200.0 <= value <= 200.0 for value in (x, y, z)):
            raise typer.BadParameter(f"--probe-offset {self.probe_offset}: -200 to 200 mm are allowed")
        return x, y, z


@dataclass(frozen=True)
class CalibrationRequest:
    """A machine profile by name, the mark that is touched on it (None: the usual one), and where the result goes.

    save: name of the user's own profile, None: the machine's. replace: write over files that exist. force: save although the
    touches are far off. directions: find those of the axes, too.
    """

    out: Annotated[Path | None, option("-o --out OUT.gcode", "program to write, with a sheet beside it to fill in")] = None
    measured: Annotated[Path | None, option("--measured FILE", "filled sheet, .toml or .csv: work out the numbers")] = None
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
        tuple[str, ...], option("--readings TEXT", "of each --printed: right,up,height of its four pads; else asked for")
    ] = ()
    html: Annotated[Path | None, option("--html FILE", "with --printed: page to type the readings on")] = None
    save: Annotated[str | None, option("--save NAME", "name of your profile; else the machine's")] = None
    replace: Replace = False
    force: Annotated[bool, option("--force", "save although touches or readings are far off")] = False
    directions: Annotated[bool, option("--directions", "also find the directions of the axes")] = False
    probing: ProbeOptions = ProbeOptions()
    given: MachineOptions = MachineOptions()


@dataclass(frozen=True, kw_only=True)
class CouponRequest:
    """Bars that tell what joints hold. shape: how the bars are broken; vary: KEY=VALUE that half of them are printed with, none:
    the usual ones; html, png: what shows them; report: a table and nothing else.

    save: name of the user's own material and process, None: theirs. replace: write over files that exist. force: write a program
    although its dry run found errors.
    """

    out: Annotated[Path | None, option("-o --out OUT.gcode", "program to write, with a sheet beside it to fill in")] = None
    measured: Annotated[Path | None, option("--measured FILE", "filled sheet, .toml: work out what holds, and save it")] = None
    report: Annotated[
        Path | None, option("--report FILE.md", "with --measured: only write it as a table; - for standard output")
    ] = None
    shape: Annotated[str, option("--shape bend|tensile", "bars for a luggage scale, or ISO 527-2 type 5A")] = "bend"
    vary: Annotated[
        tuple[str, ...], option("--vary KEY=VALUE", "what half of the bars have, not the usual four; repeatable, at most 5")
    ] = ()
    html: options.HtmlFile = None
    png: Annotated[Path | None, option("--png FILE", "picture of the bars in print order")] = None
    save: Annotated[str | None, option("--save NAME", "name of your material and process profiles; else theirs")] = None
    replace: Replace = False
    force: options.Force = False
    given: options.DefaultProfileOptions


@dataclass(frozen=True)
class ImportRequest:
    """Another slicer's settings to read, with the presets of a bundle: empty: its only or its active one."""

    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="config.ini, bundle or G-code of PrusaSlicer; JSON of OrcaSlicer; .curaprofile")
    ]
    process: Annotated[str, option("--process-preset NAME", "of a bundle's print presets")] = ""
    material: Annotated[str, option("--material-preset NAME", "of a bundle's filament presets")] = ""
    printer: Annotated[str, option("--printer-preset NAME", "of a bundle's printers, for its nozzle")] = ""
    name: Annotated[str, option("--name NAME", "of both profiles; else as there")] = ""
    out: Annotated[Path | None, option("-o --out FOLDER", "where to; else your own profiles")] = None
    replace: Replace = False
    json: Annotated[bool, option("--json", "what became of every setting as JSON")] = False


@dataclass(frozen=True)
class DetectRequest:
    """A firmware that tells of its machine, at a port or in a file. base: profile that is inherited, None: the nearest shipped
    one; out: file to write, None: in the user's own folder; replace: write over it."""

    file: Annotated[
        Path | None,
        typer.Argument(metavar="FILE", help="printer.cfg, config.g, a log of M503, a dump of $$, LinuxCNC's .ini"),
    ] = None
    port: Annotated[str | None, option("--port PORT", "of a printer; moonraker:HOST, duet:HOST; or sim")] = None
    baud: options.Baud = BAUD
    base: Annotated[str | None, option("--base NAME", "inherit it, else the nearest shipped one")] = None
    out: Annotated[Path | None, option("-o --out FILE.toml", "profile to write; else one of your own")] = None
    replace: Replace = False
    json: Annotated[bool, option("--json", "what was found, what not and what to measure as JSON")] = False
