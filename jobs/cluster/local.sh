#!/bin/bash
# {{at_once}} of {{tasks}} tasks at a time as processes of this machine, each with {{cpus}} threads; then the merge. Run again to go on.
set -u
cd {{folder}} || exit 74
{{numbers}} | xargs --max-procs {{at_once}} --replace={} \
    {{program}} run {{job}} --out {{out}} --task {}/{{tasks}} --threads {{cpus}} --progress none || exit
{{program}} merge {{out}}
