#!/usr/bin/env bash
# Slurm of the distribution on this machine, with two virtual nodes, for as long as a command runs:
# slurm.sh COMMAND [ARGUMENT...]. As root, for slurmd; exit code 77 where Slurm is not there.
set -eu
for program in munged slurmctld slurmd sbatch scontrol; do
  command -v "$program" >/dev/null || { echo "$program is not there; ./dev machines installs it"; exit 77; }
done
[ "$(id -u)" = 0 ] || { echo "Slurm's daemons want root"; exit 77; }
folder=$(mktemp -d /tmp/pointflight_slurm.XXXXXX)
chmod 755 "$folder"
export SLURM_CONF=$folder/slurm.conf

end() {
  for name in slurmd_n1 slurmd_n2 slurmctld munged; do
    [ -f "$folder/$name.pid" ] && kill "$(cat "$folder/$name.pid")" 2>/dev/null
  done
  sleep 0.5
  rm -rf "$folder"
}
trap end EXIT

# a key of its own: the system's munge stays as it is
dd if=/dev/urandom of="$folder/munge.key" bs=128 count=1 2>/dev/null
mkdir "$folder/state" "$folder/n1" "$folder/n2"
chmod 600 "$folder/munge.key"
munged --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munged.pid" \
  --log-file="$folder/munged.log" --seed-file="$folder/munge.seed" --force 2>"$folder/munged.err" ||
  { cat "$folder/munged.err"; exit 77; }

host=$(hostname)
cores=$(nproc)
cat >"$SLURM_CONF" <<CONF
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
SlurmctldPort=17001
SlurmctldPidFile=$folder/slurmctld.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdPidFile=$folder/slurmd_%n.pid
SlurmdSpoolDir=$folder/%n
SlurmdLogFile=$folder/slurmd_%n.log
StateSaveLocation=$folder/state
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=sched_min_interval=100000,bf_interval=1
ReturnToService=2
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=17002 CPUs=$cores State=UNKNOWN
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=17003 CPUs=$cores State=UNKNOWN
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
slurmctld -c -i
for node in n1 n2; do slurmd -N $node -c; done
for _ in $(seq 100); do
  [ "$(sinfo --noheader --format=%t --Node 2>/dev/null | grep -c idle)" = 2 ] && break
  sleep 0.2
done
[ "$(sinfo --noheader --format=%t --Node | grep -c idle)" = 2 ] || {
  echo "the nodes did not come up:"
  sinfo --Node || true
  tail -n 5 "$folder"/*.log
  exit 1
}
"$@"
