# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# The chain of a session, a rule per stage; shard.py runs it for the sessions of a shard. Nothing of the
# archive is an input for Snakemake: what is missing there is for the programs to report, and ends
# their session alone.
import sys
from pathlib import Path
from shlex import quote

sys.path.insert(0, workflow.basedir)
from station import last_file, row_time_known, truth_of

archive = Path(config["archive"])
shell.prefix(f"source {quote(workflow.basedir + '/stage.sh')}; PATH={quote(config['bin'])}:$PATH; ")


def in_archive(name):
    return lambda wildcards: archive / wildcards.session / name


def session_gates(wildcards):
    own = archive / wildcards.session / "gates.yaml"
    gates = own if own.exists() else config["session_gates"]
    return ["--gates", gates] if gates else []


def calibrated_lens(wildcards):
    known = row_time_known(archive / wildcards.session, config["camera"])
    return wildcards.session + ("/lens.yaml" if known else "/camera.yaml")


def dispersion(wildcards):
    """A calibration without a known station is that of the rotation."""
    return "1" if (archive / wildcards.session / "dispersion").exists() else ""


wildcard_constraints:
    session="[^/]+/[^/]+",


rule all:
    input:
        [f"{session}/{last_file(archive / session)}" for session in config["sessions"]],


rule lens:
    output:
        "{session}/lens.yaml",
    log:
        "{session}/logs/lens.txt",
    params:
        station=in_archive(""),
        id=lambda wildcards: wildcards.session.split("/")[0],
        camera=config["camera"],
    shell:
        "if [ -f {params.station:q}/camera.yaml ]; then ln -sf {params.station:q}/camera.yaml {output:q};"
        " else stage {log:q} vlp-intrinsics {params.station:q}/boards --board {params.station:q}/board.yaml"
        " --camera-id={params.id:q} {params.camera} --threads 1 -o {output:q}; fi"


rule row_time:  # where it is not stated
    input:
        "{session}/lens.yaml",
    output:
        "{session}/camera.yaml",
    log:
        "{session}/logs/row_time.txt",
    params:
        station=in_archive(""),
    shell:
        "stage {log:q} vlp-train {params.station:q}/rotation --row-time"
        " --lamps {params.station:q}/lamps.yaml --calibration {input:q} --threads 1 -o {output:q}"


rule rotation:
    input:
        calibrated_lens,
    output:
        "{session}/rotated.yaml",
    log:
        "{session}/logs/rotation.txt",
    params:
        station=in_archive(""),
    shell:
        "stage {log:q} vlp-rotation {params.station:q}/rotation --lamps {params.station:q}/lamps.yaml"
        " --calibration {input:q} --threads 1 -o {output:q}"


rule dispersion:
    input:
        "{session}/rotated.yaml",
    output:
        "{session}/calibration.yaml",
    log:
        "{session}/logs/dispersion.txt",
    params:
        station=in_archive(""),
        known=dispersion,
    shell:
        "if [ -z {params.known:q} ]; then cp {input:q} {output:q};"
        " else stage {log:q} vlp-dispersion {params.station:q}/dispersion"
        " --lamps {params.station:q}/lamps.yaml --calibration {input:q} --threads 1 -o {output:q}; fi"


rule locate:
    input:
        "{session}/calibration.yaml",
    output:
        "{session}/fixes.csv",
    log:
        "{session}/logs/locate.txt",
    params:
        station=in_archive(""),
    shell:
        "stage {log:q} vlp-locate {params.station:q}/check --lamps {params.station:q}/lamps.yaml"
        " --calibration {input:q} --threads 1 -o {output:q}"


rule evaluate:
    input:
        fixes="{session}/fixes.csv",
        calibration="{session}/calibration.yaml",
    output:
        "{session}/evaluation.json",
    log:
        "{session}/logs/evaluate.txt",
    params:
        truth=lambda wildcards: truth_of(archive / wildcards.session),
        gates=session_gates,
    shell:
        "find_unmet {wildcards.session:q}/logs/{{lens,row_time,rotation,dispersion,locate}}.txt;"
        " stage {log:q} vlp-evaluate {input.fixes:q} --truth {params.truth:q}"
        " --calibration {input.calibration:q}"
        ' {params.gates:q} "${{unmet[@]}}" --threads 1 --json {output:q}'
