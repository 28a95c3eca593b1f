#!/bin/bash
# active-recon on all nodes of a Slurm job, through Ray:
#   sbatch slurm.sh batch measure /shared/archive --out /shared/out
#SBATCH --job-name=active-recon
#SBATCH --nodes=4
#SBATCH --ntasks-per-node=1
#SBATCH --exclusive
#SBATCH --time=12:00:00
set -euo pipefail

export RAY_USAGE_STATS_ENABLED=0
# Only who has ~/.ray/auth_token is let in: the nodes share your home
export RAY_AUTH_MODE=token
ray get-auth-token --generate > /dev/null
port=6379
head=$(scontrol show hostnames "$SLURM_JOB_NODELIST" | head -n 1)
# Not --ip-address: of many hosts it is their loopback's
address=$(srun --nodes=1 --ntasks=1 --nodelist="$head" hostname --all-ip-addresses \
  | cut -d ' ' -f 1)

srun --nodes=1 --ntasks=1 --nodelist="$head" \
  ray start --head --node-ip-address "$address" --port "$port" --dashboard-host 127.0.0.1 \
  --num-cpus "$SLURM_CPUS_ON_NODE" --block &
sleep 20
if (( SLURM_NNODES > 1 )); then
  srun --nodes=$((SLURM_NNODES - 1)) --ntasks=$((SLURM_NNODES - 1)) --exclude="$head" \
    ray start --address "$address:$port" --num-cpus "$SLURM_CPUS_ON_NODE" --block &
  sleep 20
fi

# The end of the job ends Ray; a job that is killed goes on when it is submitted again
srun --overlap --nodes=1 --ntasks=1 --nodelist="$head" \
  active-recon "$@" --cluster "$address:$port"
