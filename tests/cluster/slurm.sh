#!/usr/bin/env bash
# A Slurm of four nodes on this one machine, for tests: `slurm.sh start FOLDER`, `slurm.sh stop FOLDER`. Root; packages slurm-wlm
# and munge. Everything but munge's key and socket stands in FOLDER; clients want SLURM_CONF=FOLDER/slurm.conf.
set -euo pipefail
folder=$2
export SLURM_CONF=$folder/slurm.conf

start() {
    local host
    host=$(hostname -s)
    if ! [ -f /etc/munge/munge.key ]; then
        install -m 400 /dev/null /etc/munge/munge.key
        head -c 1024 /dev/urandom > /etc/munge/munge.key
    fi
    chown munge: /etc/munge/munge.key
    install -d -o munge -g munge -m 755 /run/munge
    if ! munge -n >/dev/null 2>&1; then runuser -u munge -- /usr/sbin/munged; fi
    mkdir -p "$folder"/{state,spool-n1,spool-n2,spool-n3,spool-n4,log}
    # Nodes of two processors each whatever the machine has; a lost one is noticed within ten seconds.
    cat > "$SLURM_CONF" <<CONF
ClusterName=graspmill
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool-%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd-%n.pid
SlurmctldLogFile=$folder/log/slurmctld
SlurmdLogFile=$folder/log/%n
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_min_interval=100000,sched_interval=1,bf_interval=5
JobRequeue=1
ReturnToService=2
SlurmdTimeout=10
KillWait=5
MinJobAge=600
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SlurmdParameters=config_overrides
NodeName=n[1-4] NodeHostname=$host NodeAddr=127.0.0.1 Port=[17001-17004] CPUs=2 RealMemory=4000 State=UNKNOWN
PartitionName=all Nodes=n[1-4] Default=YES MaxTime=INFINITE State=UP
CONF
    slurmctld
    for node in n1 n2 n3 n4; do slurmd -N "$node"; done
    for _ in $(seq 100); do
        if [ "$(sinfo --noheader --states=idle --format=%D)" = 4 ]; then return; fi
        sleep 0.2
    done
    echo "slurm.sh: the nodes do not come up; see $folder/log" >&2
    exit 1
}

stop() {
    scontrol shutdown || true
}

"$1"
