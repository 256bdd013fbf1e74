#!/bin/bash
#SBATCH --job-name={{ name }}-merge
#SBATCH --cpus-per-task={{ cpus }}
#SBATCH --mem={{ memory }}M
#SBATCH --time={{ minutes }}
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output={{ logs | log_name }}/%j_merge.log
{% for option in options %}
#SBATCH {{ option }}
{% else %}

{% endfor %}
# Sent with --dependency=afterok on the tasks. Checks every shard, writes index, manifest and root digest.
set -u
# Programs are found by absolute folders of PATH: what stands in the current folder is data.
path=; IFS=:; for part in $PATH; do case $part in /*) path=$path:$part;; esac; done; unset IFS; PATH=${path#:}
cd {{ folder }} || exit 74
{{ program }} merge {{ out }} --threads {{ cpus }}
code=$?
# 3: complete, but meshes were refused. The log names them; Slurm would call it a failure.
if [ "$code" -eq 3 ]; then exit 0; fi
exit "$code"
