#!/usr/bin/env bash
# Runs a command beside a small Slurm cluster of its own: munged, slurmctld and two slurmd on this machine, on
# free ports of the loopback interface. The cluster lives as long as the command, and all of it is stopped then.
#
#     scripts/real_slurm.sh COMMAND [ARGUMENT]...
#     scripts/real_slurm.sh bash          # sbatch, squeue, scancel, ... talk to this cluster
#
# Needs root (slurmd starts jobs as their users) and Debian's packages of munge and Slurm, which it installs when
# they are missing. PAO_SIM_MAX_ARRAY_SIZE sets the cluster's MaxArraySize. tests/real_slurm.rs runs a study here.
set -euo pipefail

packages=(munge slurmctld slurmd slurm-client)

fail() {
    echo "real_slurm.sh: $*" >&2
    exit 1
}

[ $# -gt 0 ] || fail "give the command that is to run beside the cluster, such as bash"
[ "$(id -u)" = 0 ] || fail "needs root, because slurmd starts jobs as their users"

# Daemons lie where not every root looks.
PATH=$PATH:/usr/sbin:/sbin
missing=
for program in munged slurmctld slurmd sbatch; do
    command -v "$program" >/dev/null || missing=yes
done
if [ "$missing" ]; then
    command -v apt-get >/dev/null || fail "needs ${packages[*]}; install them (there is no apt-get here to do it)"
    echo "real_slurm.sh: installs ${packages[*]}" >&2
    # Without a policy against it, a package's installation would start its daemon with the system's configuration.
    if [ ! -e /usr/sbin/policy-rc.d ]; then
        printf '#!/bin/sh\nexit 101\n' >/usr/sbin/policy-rc.d
        chmod +x /usr/sbin/policy-rc.d
        trap 'rm -f /usr/sbin/policy-rc.d' EXIT
    fi
    export DEBIAN_FRONTEND=noninteractive
    { apt-get update && apt-get install -y --no-install-recommends "${packages[@]}"; } >&2 ||
        fail "could not install ${packages[*]}"
    if [ "$(trap -p EXIT)" ]; then
        rm -f /usr/sbin/policy-rc.d
        trap - EXIT
    fi
fi

# Users munge and, in jobs, others pass through the folder.
dir=$(mktemp -d "${TMPDIR:-/tmp}/pao-sim-slurm.XXXXXX")
chmod 755 "$dir"
export SLURM_CONF=$dir/slurm.conf
munged= slurmctld= slurmd=()

alive() { kill -0 "$1" 2>/dev/null; }

# Waits until a process is gone, for so many tenths of a second.
gone() {
    for ((i = 0; i < $2; i++)); do
        alive "$1" || return 0
        sleep 0.1
    done
    return 1
}

# Ends processes that this script started: softly, then hard.
end() {
    for pid in "$@"; do alive "$pid" && kill -TERM "$pid"; done
    for pid in "$@"; do gone "$pid" 100 || kill -KILL "$pid"; done
    wait "$@" 2>/dev/null
}

# The job steps' processes, which outlive slurmd: they carry this cluster's configuration in their environment.
steps() {
    for environment in /proc/[0-9]*/environ; do
        pid=${environment#/proc/}
        pid=${pid%/environ}
        [ "$pid" = $$ ] && continue
        { tr '\0' '\n' <"$environment" | grep -qxF "SLURM_CONF=$SLURM_CONF"; } 2>/dev/null || continue
        # A process of a job, or its step's slurmstepd; not the command that this script runs.
        { tr '\0' '\n' <"$environment" | grep -q '^SLURM_JOB_ID='; } 2>/dev/null && echo "$pid" && continue
        case "$({ tr '\0' ' ' <"/proc/$pid/cmdline"; } 2>/dev/null)" in slurmstepd*) echo "$pid" ;; esac
    done
}

tear_down() {
    set +e
    if [ "$slurmctld" ] && alive "$slurmctld"; then
        scancel --user="$(id -un)"
        for ((i = 0; i < 50; i++)); do
            [ "$(steps)" ] || break
            sleep 0.1
        done
    fi
    end "${slurmd[@]}" $slurmctld $munged
    # shellcheck disable=SC2046 # One word a process is meant.
    [ "$(steps)" ] && kill -KILL $(steps)
    if [ "${1:-0}" != 0 ]; then
        tail -n 15 "$dir"/*.log >&2
    fi
    rm -rf "$dir"
}
trap 'tear_down $?' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

# A port that nobody listens on; below those that the kernel gives away itself.
free_port() {
    for ((i = 0; i < 200; i++)); do
        port=$((20000 + RANDOM % 12000))
        case " ${ports[*]} " in *" $port "*) continue ;; esac
        (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null || return 0
    done
    fail "found no free port from 20000 to 31999 on 127.0.0.1"
}
ports=()
for ((n = 0; n < 3; n++)); do
    free_port
    ports+=("$port")
done

host=$(hostname -s)
mkdir "$dir/munge" "$dir/state"
dd if=/dev/urandom of="$dir/munge/key" bs=128 count=1 status=none
chmod 400 "$dir/munge/key"
chown -R munge: "$dir/munge"
# The nodes share this machine's processors and memory; nothing confines a job to what it was given.
cat >"$SLURM_CONF" <<CONF
ClusterName=paosim
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=${ports[0]}
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
SlurmUser=root
AuthType=auth/munge
# A short-lived credential: a requeued job waits until its first one is void.
AuthInfo=socket=$dir/munge/socket,cred_expire=10
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool-%n
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd-%n.pid
SlurmdParameters=config_overrides
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=2
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
ReturnToService=2
KillWait=10
MaxArraySize=${PAO_SIM_MAX_ARRAY_SIZE:-1001}
MinJobAge=3600
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=${ports[1]} CPUs=2 RealMemory=4000
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=${ports[2]} CPUs=2 RealMemory=4000
PartitionName=main Nodes=n1,n2 Default=YES MaxTime=UNLIMITED DefaultTime=10 State=UP
CONF

# In the foreground each, as children: their process ids are known.
setpriv --reuid=munge --regid=munge --clear-groups munged --foreground --force --key-file="$dir/munge/key" --socket="$dir/munge/socket" \
    --pid-file="$dir/munge/pid" --log-file="$dir/munge/log" --seed-file="$dir/munge/seed" >"$dir/munged.log" 2>&1 &
munged=$!
for ((i = 0; i < 100; i++)); do
    [ -S "$dir/munge/socket" ] && break
    alive "$munged" || fail "munged did not start"
    sleep 0.1
done
slurmctld -D -i >"$dir/slurmctld.log" 2>&1 &
slurmctld=$!
for node in n1 n2; do
    slurmd -D -N "$node" >"$dir/slurmd-$node.log" 2>&1 &
    slurmd+=($!)
done

up=
for ((i = 0; i < 300; i++)); do
    for pid in "$slurmctld" "${slurmd[@]}"; do alive "$pid" || fail "a daemon of Slurm ended at its start"; done
    if [ "$(sinfo -h -N -t idle -o %N 2>/dev/null | sort -u | wc -l)" = 2 ]; then
        up=yes
        break
    fi
    sleep 0.1
done
[ "$up" ] || fail "the two nodes were not idle after 30 seconds"

"$@"
