#!/bin/bash
# GNU parallel: {{at_once}} of {{tasks}} tasks at a time, each with {{cpus}} threads, a failed one three times; then the merge. On several
# machines that share the file system: add --sshloginfile. Run again to go on.
set -u
cd {{folder}} || exit 74
{{numbers}} | parallel --jobs {{at_once}} --retries 3 --joblog {{logs}}/parallel.log \
    {{program}} run {{job}} --out {{out}} --task {}/{{tasks}} --threads {{cpus}} --progress none || exit
{{program}} merge {{out}}
