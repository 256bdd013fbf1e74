#!/bin/bash
# {{ at_once }} of {{ tasks }} tasks at a time as processes of this machine, each with {{ cpus }} threads; then the merge. Run again to go on.
set -u
# Programs are found by absolute folders of PATH: what stands in the current folder is data.
path=; IFS=:; for part in $PATH; do case $part in /*) path=$path:$part;; esac; done; unset IFS; PATH=${path#:}
cd {{ folder }} || exit 74
run_task() {
    exec {{ program }} run {{ job }}{% for setting in overrides %} --set {{ setting }}{% endfor %} --out {{ out }} --task "$1/{{ tasks }}" --threads {{ cpus }} --progress none
}
export -f run_task
{% if some %}printf '%s\n'{% for task in some %} {{ task }}{% endfor %}{% else %}seq 0 {{ last }}{% endif %} | xargs --max-procs {{ at_once }} --replace={} bash -c 'run_task {}' || exit
{{ program }} merge {{ out }}
