#!/usr/bin/env bash
# Converts a collection as an array of Slurm jobs: sbatch slurm.sh SCANS MODELS
# The same line continues what a time limit cut short.
#SBATCH --job-name=relief
#SBATCH --array=1-8
#SBATCH --cpus-per-task=4
#SBATCH --mem=16G
#SBATCH --time=08:00:00
exec relief batch "$1" -o "$2" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" \
  --jobs 1 --threads "$SLURM_CPUS_PER_TASK"
