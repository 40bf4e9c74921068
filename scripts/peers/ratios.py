#!/usr/bin/env python3
"""Prints as one table what scripts/compare_peers.sh measured: for each case the other side, then ours after each kind of edit."""
import json
import sys

theirs = None
print('| case | edit | noise, Mitsuba | noise, biscale | CPU s, Mitsuba | CPU s, biscale | times less CPU | peak MiB, Mitsuba | peak MiB, biscale |')
print('|---|---|---|---|---|---|---|---|---|')
for line in open(sys.argv[1]):
    result = json.loads(line)
    if 'edit' not in result:
        theirs = result
        continue
    print('| {} | {} | {:.2f} % | {:.2f} % | {:.2f} | {:.4f} | {:.0f} | {} | {} |'.format(
        result['case'], result['edit'], 100 * theirs['noise'], 100 * result['noise'], theirs['cpu_s'], result['cpu_s'],
        theirs['cpu_s'] / result['cpu_s'], theirs['peak_mib'], result['peak_mib']))
