import cmath, json, sys

def say(**answer):
    print(json.dumps(answer), flush=True)

def unit(bearing):
    return cmath.rect(1, bearing["azimuth_rad"])

hello = json.loads(sys.stdin.readline())
home = {b["id"]: unit(b) for b in hello["home"]["bearings"]}
say(protocol=1)
for line in sys.stdin:
    both = [(unit(b), home[b["id"]]) for b in json.loads(line)["bearings"] if b["id"] in home]
    if len(both) < 2:
        say(v_m_s=0, omega_rad_s=0.6)  # look around
        continue
    turn = cmath.phase(sum(then / now for now, then in both))  # the robot's heading, from home's
    vector = sum(now - then * cmath.rect(1, -turn) for now, then in both) / len(both)
    speed = hello["task"]["speed_m_s"] * max(vector.real, 0) / max(abs(vector), 0.08)
    say(v_m_s=speed, omega_rad_s=1.5 * cmath.phase(vector), done=abs(vector) < 0.005)
