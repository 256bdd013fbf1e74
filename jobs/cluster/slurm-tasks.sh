#!/bin/bash
#SBATCH --job-name={{ name }}
#SBATCH --array={{ array }}{% if limit %}%{{ limit }}{% endif +%}
#SBATCH --cpus-per-task={{ cpus }}
#SBATCH --mem={{ memory }}M
#SBATCH --time={{ minutes }}
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output={{ logs | log_name }}/%A_%a.log
#SBATCH --signal=B:USR1@60
{% for option in options %}
#SBATCH {{ option }}
{% else %}

{% endfor %}
# Task K of {{ tasks }} makes those of the dataset's shards whose number, divided by {{ tasks }}, leaves K. A task that runs twice, or
# beside its own double, does no harm: what is finished stays, and equal shards have equal names.
set -u
# Programs are found by absolute folders of PATH: what stands in the current folder is data.
path=; IFS=:; for part in $PATH; do case $part in /*) path=$path:$part;; esac; done; unset IFS; PATH=${path#:}
cd {{ folder }} || exit 74

# Before its time is up, and where it must make room, Slurm signals this shell alone: pass it on. The program then ends with 75.
trap 'kill -USR1 "$task" 2>/dev/null' USR1 TERM
{{ program }} run {{ job }}{% for setting in overrides %} --set {{ setting }}{% endfor %} --out {{ out }} --task "$SLURM_ARRAY_TASK_ID/{{ tasks }}" --threads {{ cpus }} --progress plain &
task=$!
# A signal that is caught ends `wait` early.
while kill -0 "$task" 2>/dev/null; do wait "$task"; done
wait "$task"
code=$?

# Interrupted: into the queue again, to go on from the finished shards. No exit code does that by itself.
if [ "$code" -eq 75 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt 20 ]; then
    scontrol requeue "${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}"
fi
exit "$code"
