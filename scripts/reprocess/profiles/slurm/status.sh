#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# Says to Snakemake whether a job of Slurm runs, succeeded or failed. A controller that does not answer,
# because it restarts, is asked again later; a job that it does not know any more failed.
said=$(scontrol show job "$1" --oneliner 2>&1) || {
  [[ $said == *"Invalid job id"* ]] && echo failed || echo running
  exit
}
case ${said#*JobState=} in
  COMPLETED\ *) echo success ;;
  PENDING\ * | CONFIGURING\ * | RUNNING\ * | COMPLETING\ * | SUSPENDED\ * | REQUEUED\ *) echo running ;;
  *) echo failed ;;
esac
