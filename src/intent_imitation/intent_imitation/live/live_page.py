"""The page of the live view: the picture, and the posterior over time; no file but this."""

import json

from intent_imitation.demo.mesh_pictures import SPARE_COLORS, TASK_COLORS

_HTML = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Intent, live</title>
<style>
:root{--ink:#1f2933;--soft:#5c6873;--line:#e1e6eb}
*{box-sizing:border-box}
body{margin:0;background:#f5f7f9;color:var(--ink);line-height:1.45;
font-family:system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif}
main{max-width:940px;margin:0 auto;padding:1rem}
h1{font-size:1.1rem;margin:0 0 .6rem}
section{background:#fff;border:1px solid var(--line);border-radius:10px;padding:.8rem;
margin:0 0 1rem}
img{display:block;width:100%;height:auto;border-radius:6px;background:#181d24;aspect-ratio:900/480}
h2{font-size:.95rem;margin:0 0 .3rem}
canvas{display:block;width:100%;height:240px}
ul{list-style:none;display:flex;flex-wrap:wrap;gap:.3rem 1.1rem;margin:.4rem 0 0;padding:0}
li{font-size:.92rem;white-space:nowrap}
li i{display:inline-block;width:.8em;height:.8em;border-radius:2px;margin-right:.4em}
p{margin:.3rem 0 0;color:var(--soft);font-size:.92rem}
</style></head><body><main>
<h1 id="status">Waiting for pictures</h1>
<section><img id="view" alt="The camera's picture with objects, hand, stage and posterior">
</section>
<section><h2>What the person means, over time</h2><canvas id="chart"></canvas>
<ul id="legend"></ul>
<p>Thin: the hand still reaches, a forecast. Dashed: a stable grasp. With "none of these" the
probabilities of the tasks sum to one.</p></section>
</main><script>
const COLORS=%COLORS%,SPARE=%SPARE%;
const $=id=>document.getElementById(id);
function color(task,tasks){if(COLORS[task])return COLORS[task];
 const spare=tasks.filter(t=>!COLORS[t]);return SPARE[spare.indexOf(task)%SPARE.length]}
function draw(s){const c=$("chart"),r=window.devicePixelRatio||1,w=c.clientWidth,h=c.clientHeight;
 c.width=w*r;c.height=h*r;const g=c.getContext("2d");g.scale(r,r);g.font="12px sans-serif";
 const L=34,R=8,T=10,B=34,end=Math.max(s.now,10),start=Math.max(0,end-30);
 const x=t=>L+(t-start)/(end-start)*(w-L-R),y=p=>T+(1-p)*(h-T-B);
 g.fillStyle="#5c6873";g.strokeStyle="#e1e6eb";g.lineWidth=1;g.textAlign="right";
 for(const p of[0,.5,1]){g.beginPath();g.moveTo(L,y(p));g.lineTo(w-R,y(p));g.stroke();
  g.fillText(p.toFixed(1),L-6,y(p)+4)}
 for(let t=Math.ceil(start/5)*5;t<=end;t+=5){
  g.textAlign=t>end-.6?"right":"center";g.fillText(t+" s",x(t),h-B+18)}
 g.save();g.beginPath();g.rect(L,0,w-L-R,h-B+1);g.clip();
 g.strokeStyle="#1f2933";g.setLineDash([5,4]);
 for(const t of s.grasps){g.beginPath();g.moveTo(x(t),T);g.lineTo(x(t),h-B);g.stroke()}
 g.setLineDash([]);
 s.tasks.forEach((task,k)=>{g.strokeStyle=g.fillStyle=color(task,s.tasks);
  for(let i=0;i<s.points.length;i++){const p=s.points[i],q=s.points[i+1];
   if(!p[1]){g.beginPath();g.arc(x(p[0]),y(p[k+2]),4,0,7);g.fill()}
   const to=q?q[0]:s.now;g.lineWidth=p[1]?1.4:3;
   if(p[1]&&(!q||q[0]-p[0]>.5))continue;
   g.beginPath();g.moveTo(x(p[0]),y(p[k+2]));
   if(p[1])g.lineTo(x(q[0]),y(q[k+2]));else g.lineTo(x(to),y(p[k+2]));g.stroke()}});
 g.restore()}
let seen="";
async function look(){try{const s=await(await fetch("state.json")).json();
 const last=s.points[s.points.length-1];
 $("status").textContent="The hand: "+s.stage+(s.object?" "+s.object:"")+
  (s.answer?". The robot "+s.answer:"");
 $("legend").replaceChildren(...s.tasks.map((t,k)=>{const l=document.createElement("li"),
  i=document.createElement("i");i.style.background=color(t,s.tasks);
  l.append(i,t+(last?" "+last[k+2].toFixed(2):""));return l}));
 draw(s);const now=s.picture;if(now&&now!==seen){seen=now;$("view").src="image.jpg?"+now}
 }catch(e){$("status").textContent="The viewer does not answer"}
 setTimeout(look,200)}
look();
</script></body></html>
"""

PAGE = _HTML.replace("%COLORS%", json.dumps(TASK_COLORS)).replace(
    "%SPARE%", json.dumps(SPARE_COLORS)
)
"""HTML."""
