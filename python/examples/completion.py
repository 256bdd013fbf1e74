"""Trains a small 3D network to complete shapes, straight from the compressed shards. Needs PyTorch.

python python/examples/completion.py datasets/quickstart --epochs 3
"""

import argparse

import torch
from graspmill import CompletionSample, Dataset
from graspmill.torch import ShuffledChunks, collate, unpack
from torch import nn
from torch.utils.data import DataLoader

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("dataset")
parser.add_argument("--epochs", type=int, default=3)
parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
given = parser.parse_args()
torch.manual_seed(0)

train = Dataset(given.dataset, CompletionSample, split="training", channels=["pair"])
test = Dataset(given.dataset, CompletionSample, split="test", channels=["pair"])
batches = ShuffledChunks(train, seed=0, batch=32)
loader = DataLoader(batches, batch_size=None, num_workers=1)
down = [
    nn.Conv3d(1, 16, 4, 2, 1),
    nn.ReLU(),
    nn.Conv3d(16, 32, 4, 2, 1),
    nn.ReLU(),
    nn.Conv3d(32, 64, 4, 2, 1),
    nn.ReLU(),
]
up = [nn.ConvTranspose3d(64, 32, 4, 2, 1), nn.ReLU(), nn.ConvTranspose3d(32, 16, 4, 2, 1), nn.ReLU()]
model = nn.Sequential(*down, *up, nn.ConvTranspose3d(16, 1, 4, 2, 1)).to(given.device)
optimiser = torch.optim.Adam(model.parameters(), 2e-3)

for epoch in range(given.epochs):
    batches.set_epoch(epoch)
    total = count = 0.0
    for batch in loader:
        partial = unpack(batch["partial"].to(given.device), batch["resolution"])
        complete = unpack(batch["complete"].to(given.device), batch["resolution"])
        loss = nn.functional.binary_cross_entropy_with_logits(model(partial), complete)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        total, count = total + loss.item() * len(partial), count + len(partial)
    print(f"epoch {epoch}: loss {total / count:.4f} over {count:.0f} pairs", flush=True)

overlap = []
with torch.no_grad():
    for batch in DataLoader(test, batch_size=32, collate_fn=collate):
        found = model(unpack(batch["partial"].to(given.device), batch["resolution"])) > 0
        truth = unpack(batch["complete"].to(given.device), batch["resolution"]) > 0
        both, either = (found & truth).flatten(1).sum(1), (found | truth).flatten(1).sum(1)
        overlap += (both / either.clamp(min=1)).tolist()
print(f"mean Jaccard overlap on {len(overlap)} pairs of objects not trained on: {sum(overlap) / len(overlap):.3f}")
