# To be sourced by tests that need a cluster: a Slurm of its own in the folder $cluster, with two nodes of one processor each on this
# computer. It needs no rights, opens ports of 127.0.0.1 alone, and leaves the computer's own Slurm, if there is one, as it is.
# has_slurm: fails if its programs are not installed
has_slurm() { PATH=$PATH:/usr/sbin command -v munged slurmctld slurmd sbatch squeue scontrol >/dev/null; }
free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

# start_slurm: fails, with the reason in why.txt, if a daemon does not start
start_slurm() {
  local host user node
  host=$(hostname -s) user=$(id -un)
  export PATH=$PATH:/usr/sbin SLURM_CONF=$cluster/slurm.conf
  mkdir -p "$cluster/state" "$cluster/spool"
  chmod 755 "$cluster"
  dd if=/dev/urandom of="$cluster/munge.key" bs=128 count=1 status=none
  chmod 600 "$cluster/munge.key"
  cat >"$SLURM_CONF" <<END
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$(free_port)
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$cluster/munge.socket,cred_expire=3
CryptoType=crypto/munge
CredType=cred/munge
StateSaveLocation=$cluster/state
SlurmdSpoolDir=$cluster/spool/%n
SlurmctldPidFile=$cluster/slurmctld.pid
SlurmdPidFile=$cluster/%n.pid
SlurmctldLogFile=$cluster/slurmctld.log
SlurmdLogFile=$cluster/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdTimeout=6
SlurmctldTimeout=6
KillWait=2
ReturnToService=2
SchedulerParameters=defer_batch=0,sched_interval=1,batch_sched_delay=0,requeue_setup_env_fail
MinJobAge=600
MailProg=/bin/true
NodeName=node1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$(free_port) CPUs=1 RealMemory=1000
NodeName=node2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$(free_port) CPUs=1 RealMemory=1000
PartitionName=all Nodes=node1,node2 Default=YES MaxTime=10 State=UP
END
  munged --force --key-file="$cluster/munge.key" --socket="$cluster/munge.socket" --pid-file="$cluster/munged.pid" \
    --log-file="$cluster/munged.log" --seed-file="$cluster/munged.seed" >why.txt 2>&1 || return 1
  slurmctld >why.txt 2>&1 || return 1
  for node in node1 node2; do slurmd -N $node >why.txt 2>&1 || return 1; done
  for ((i = 0; i < 200; i++)); do
    [ "$(sinfo -h -t idle -o %D 2>why.txt)" = 2 ] && return 0
    sleep 0.1
  done
  sinfo -R >>why.txt 2>&1
  tail -n 5 "$cluster"/*.log >>why.txt
  return 1
}
# kill_node NODE PROGRAM: kills everything of the node at once, as soon as PROGRAM runs on it, as if the computer had lost its power
kill_node() {
  python3 - "$cluster" "$1" "$2" <<'END'
import os, signal, sys, time
cluster, node, program = sys.argv[1:]
def read(pid, what):
    try:
        return open(f"/proc/{pid}/{what}", "rb").read()
    except OSError:
        return b""
for attempt in range(3000):
    of_node = [pid for pid in os.listdir("/proc") if pid.isdigit()
               and {b"SLURM_CONF=" + os.fsencode(cluster) + b"/slurm.conf", b"SLURMD_NODENAME=" + node.encode()} <= set(read(pid, "environ").split(b"\0"))]
    if any(program.encode() in read(pid, "cmdline").split(b"\0") for pid in of_node):
        above = {read(pid, "stat").rsplit(b")", 1)[1].split()[1].decode() for pid in of_node}
        steps = {pid for pid in above if read(pid, "comm").startswith(b"slurmstepd")}
        for pid in [open(f"{cluster}/{node}.pid").read().strip(), *steps, *of_node]:
            os.kill(int(pid), signal.SIGKILL)
        sys.exit(0)
    time.sleep(0.01)
sys.exit(f"no {program} ran on {node}")
END
}
# stop_slurm: ends the daemons of this cluster
stop_slurm() {
  local file
  for file in "$cluster"/node?.pid "$cluster"/slurmctld.pid "$cluster"/munged.pid; do
    [ -s "$file" ] && kill "$(cat "$file")" 2>/dev/null
  done
  sleep 0.3
  for file in "$cluster"/node?.pid "$cluster"/slurmctld.pid; do
    [ -s "$file" ] && kill -9 "$(cat "$file")" 2>/dev/null
  done
  return 0
}
