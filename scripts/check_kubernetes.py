#!/usr/bin/env python3
"""Reads deploy/kubernetes.yaml, checks what its safety rests on, and prints the arguments of the first pod, one a line.

    scripts/check_kubernetes.py deploy/kubernetes.yaml FOLDER_FOR_DATA

`$(SHARD_INDEX)` becomes 0 and `/data/` the folder.
"""
import re
import sys

import yaml


def main():
    path, folder = sys.argv[1:]
    with open(path) as file:
        documents = {document["kind"]: document for document in yaml.safe_load_all(file)}
    job, claim = documents["Job"]["spec"], documents["PersistentVolumeClaim"]
    pod = job["template"]["spec"]
    container, = pod["containers"]
    problems = []

    def check(fine, problem):
        if not fine:
            problems.append(problem)

    arguments = container["args"]
    shard = next(re.fullmatch(r"--shard=\$\((\w+)\)/(\d+)", a) for a in arguments if a.startswith("--shard="))
    check(job["completionMode"] == "Indexed", "completionMode is not Indexed")
    check(int(shard[2]) == job["completions"] == job["parallelism"], "completions, parallelism and --shard differ")
    names = [variable["name"] for variable in container["env"]]
    check(shard[1] in names, f"no environment variable {shard[1]}")
    check(pod["restartPolicy"] == "Never", "backoffLimitPerIndex needs restartPolicy Never")
    check(pod["securityContext"]["runAsNonRoot"] and pod["securityContext"]["runAsUser"] > 0, "runs as root")
    security = container["securityContext"]
    check(security["readOnlyRootFilesystem"], "the root file system can be written")
    check(not security["allowPrivilegeEscalation"] and security["capabilities"]["drop"] == ["ALL"], "privileges")
    mounts = {mount["mountPath"]: mount["name"] for mount in container["volumeMounts"]}
    volumes = {volume["name"]: volume for volume in pod["volumes"]}
    check("emptyDir" in volumes[mounts["/tmp"]], "/tmp is no emptyDir")
    data = volumes[mounts["/data"]]["persistentVolumeClaim"]["claimName"]
    check(data == claim["metadata"]["name"], "/data is another claim")
    check(claim["spec"]["accessModes"] == ["ReadWriteMany"], "pods on several nodes need ReadWriteMany")
    if problems:
        sys.exit(f"{path}: " + "; ".join(problems))
    for argument in arguments:
        print(argument.replace(f"$({shard[1]})", "0").replace("/data/", folder + "/"))


if __name__ == "__main__":
    main()
