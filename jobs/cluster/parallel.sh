#!/bin/bash
# GNU parallel: {{ at_once }} of {{ tasks }} tasks at a time, each with {{ cpus }} threads, a failed one three times; then the merge. On several
# machines that share the file system: add --sshloginfile. Run again to go on.
set -u
# Programs are found by absolute folders of PATH: what stands in the current folder is data.
path=; IFS=:; for part in $PATH; do case $part in /*) path=$path:$part;; esac; done; unset IFS; PATH=${path#:}
cd {{ folder }} || exit 74
run_task() {
    {{ program }} run {{ job }}{% for setting in overrides %} --set {{ setting }}{% endfor %} --out {{ out }} --task "$1/{{ tasks }}" --threads {{ cpus }} --progress none
}
export -f run_task
export PARALLEL_SHELL=$BASH
{% if some %}printf '%s\n'{% for task in some %} {{ task }}{% endfor %}{% else %}seq 0 {{ last }}{% endif %} | parallel --env run_task --jobs {{ at_once }} --retries 3 --joblog {{ logs }}/parallel.log run_task {} || exit
{{ program }} merge {{ out }}
