// A client of the pedestrian in ten lines, three times: hands a walk of two feet in and takes its track out.

const CURL = `S=SERVER/api/v1; A="Authorization: Bearer $TOKEN"; J="Content-Type: application/json"
WHO=$(curl -s -H "$A" $S/inspectors | jq -r '.[0].id')
ID=$(curl -s -H "$A" -H "$J" $S/sessions -d "{\\"inspector_id\\":\\"$WHO\\"}" | jq -r .id)
for FOOT in left right; do
  LOG=$(curl -s -H "$A" -H "$J" $S/sessions/$ID/logs -d "{\\"foot\\":\\"$FOOT\\"}" | jq -r .id)
  curl -s -H "$A" -H "Upload-Offset: 0" -H "Content-Type: application/octet-stream" -X PATCH --data-binary @$FOOT.csv $S/logs/$LOG
  curl -s -H "$A" -H "$J" $S/logs/$LOG/finish -d "{\\"sha256\\":\\"$(sha256sum $FOOT.csv | cut -d' ' -f1)\\"}"
done
JOB=$(curl -s -H "$A" -H "$J" $S/sessions/$ID/process -d '{}' | jq -r .id)
until curl -s -H "$A" $S/jobs/$JOB | jq -r .state | grep -q finished; do sleep 1; done; curl -s -H "$A" $S/sessions/$ID/track.csv`;

const PYTHON = `import hashlib, os, time, requests
api, s = "SERVER/api/v1", requests.Session()
s.headers["Authorization"] = "Bearer " + os.environ["TOKEN"]
walk = s.post(api + "/sessions", json={"inspector_id": s.get(api + "/inspectors").json()[0]["id"]}).json()["id"]
for foot in "left", "right":
    data = open(foot + ".csv", "rb").read()
    log = api + "/logs/" + s.post(f"{api}/sessions/{walk}/logs", json={"foot": foot}).json()["id"]
    s.patch(log, data=data, headers={"Upload-Offset": "0"})
    s.post(log + "/finish", json={"sha256": hashlib.sha256(data).hexdigest()}).raise_for_status()
job = s.post(f"{api}/sessions/{walk}/process", json={}).json()["id"]
while s.get(f"{api}/jobs/{job}").json()["state"] not in ("finished", "failed"): time.sleep(1)
print(s.get(f"{api}/sessions/{walk}/track.csv").text)`;

const JAVASCRIPT = `import { createHash } from "node:crypto"; import { readFile } from "node:fs/promises";
const ask = (path, body, method = body ? "POST" : "GET", headers = { "Content-Type": "application/json" }) =>
  fetch("SERVER/api/v1" + path, { method, headers: { Authorization: "Bearer " + process.env.TOKEN, ...headers }, body });
const json = async (...asked) => (await ask(...asked)).json(), say = JSON.stringify;
const walk = (await json("/sessions", say({ inspector_id: (await json("/inspectors"))[0].id }))).id;
for (const foot of ["left", "right"]) {
  const data = await readFile(foot + ".csv"), log = (await json("/sessions/" + walk + "/logs", say({ foot }))).id;
  await ask("/logs/" + log, data, "PATCH", { "Upload-Offset": "0" });
  await json("/logs/" + log + "/finish", say({ sha256: createHash("sha256").update(data).digest("hex") }));
}
const job = (await json("/sessions/" + walk + "/process", "{}")).id;
while (!["finished", "failed"].includes((await json("/jobs/" + job)).state)) await new Promise((r) => setTimeout(r, 1000));
console.log(await (await ask("/sessions/" + walk + "/track.csv")).text());`;

/**
 * By their language, for the server at this address.
 * @param {string} server
 * @returns {[string, string][]}
 */
export const clients = (server) =>
  [
    ["curl", CURL],
    ["Python", PYTHON],
    ["JavaScript", JAVASCRIPT],
  ].map(([name, lines]) => [name, lines.replaceAll("SERVER", server)]);
